"""The newest notice, over the lower left of the picture, with buttons that take it away or do what it advises; the one
before comes up after it. Above it the long work that is under way, below it what gives a guess true depth.
"""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.model import depth_models, messages, opening
from viewer.model.action import Action, do
from viewer.model.commands import BY_NAME
from viewer.model.depth_models import offered_model
from viewer.model.layout import MARGIN, STRIP_GAP, Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import ModelOffer
from viewer.model.state.notices import Notice
from viewer.ui.overlays.progress_rows import build_rows, progress_rows
from viewer.ui.overlays.prompt_rows import CARD_FLAGS, button_rows
from viewer.ui.style import palette_of
from viewer.ui.widgets import colored, quiet

NOTICE_WIDTH = 420.0
LEAST_WIDTH, LEAST_HEIGHT = 160.0, 40.0


def notices(state: AppState, layout: Layout) -> list[Action]:
    """Build the newest notice; what was pressed comes back as actions."""
    rows, offer = progress_rows(state), offered_model(state)
    if not (state.notices or rows or offer):
        return []
    margin = MARGIN * layout.ui_scale
    right, bottom = layout.panel.x - margin, layout.window.height - margin
    if layout.strip_across is not None and layout.strip_down is not None:
        right, bottom = layout.strip_down.x - STRIP_GAP * layout.ui_scale, layout.strip_across.y - margin / 2
    elif layout.status is not None:
        bottom = layout.status.y
    elif layout.filmstrip is not None:
        bottom = layout.filmstrip.y - margin / 2
    if right - margin < LEAST_WIDTH * layout.ui_scale:  # the panel gives way: it must be possible to read them
        right = layout.window.width - margin
    width = min(NOTICE_WIDTH * layout.ui_scale, right - margin)
    if width <= 0:
        return []
    imgui.set_next_window_pos(imgui.ImVec2(margin, bottom), 0, imgui.ImVec2(0, 1))
    most = max(bottom - margin / 2, LEAST_HEIGHT * layout.ui_scale)
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, most))
    imgui.begin("notices", None, CARD_FLAGS)
    if state.prompt is not None:  # what is asked has buttons that must be seen
        imgui.internal.bring_window_to_display_back(imgui.internal.get_current_window())
    actions = build_rows(rows, layout)
    if state.notices:
        actions += _notice(state.notices[-1], state)
    if offer is not None:
        actions += _offer(offer)
    imgui.end()
    return actions


def _offer(model: ModelOffer) -> list[Action]:
    """How to get true depth in place of a guess; nothing more is asked."""
    words, button = f"{model.title}, on this machine, finds true depth.", "Estimate depth"
    if model.lacks:
        words = f"{model.title}: {model.lacks}"
    elif not model.is_here:
        words = f"{model.title} finds true depth: {model.megabytes:,} MB, {model.licence}, from {model.host}."
        button = "Get true depth"
    actions: list[Action] = [do(depth_models.show_offer, False)] if imgui.button("×##offer") else []
    imgui.same_line()
    imgui.begin_group()
    imgui.align_text_to_frame_padding()
    imgui.text_wrapped("Depth is guessed: near and far may be wrong.")
    quiet(words)
    if not model.lacks:
        actions += button_rows([(button, do(depth_models.get_depth))])
    imgui.end_group()
    return actions


def _notice(notice: Notice, state: AppState) -> list[Action]:
    """The notice, what it offers, and how many more there are."""
    palette, others = palette_of(state.preferences.theme), len(state.notices) - 1
    actions: list[Action] = [do(messages.dismiss, notice)] if imgui.button("×") else []
    imgui.same_line()
    imgui.begin_group()
    imgui.align_text_to_frame_padding()
    colored(notice.text, imgui.ImVec4(*(palette.error if notice.is_error else palette.text)))
    offers: list[tuple[str, Action]] = [(name, BY_NAME[name].action(state)) for name in notice.commands]
    offers += [("Use its settings", do(opening.take_settings, notice.offer))] if notice.offer is not None else []
    offers += [(f"Close all ({others + 1})", do(messages.dismiss))] if others else []
    actions += button_rows(offers)
    imgui.end_group()
    return actions
