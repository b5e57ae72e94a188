"""Notices over the lower left of the picture, each with a button that takes it away, and one for what it offers; above
them the picture that is being saved.
"""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.model.actions import Action, DismissNotice, DoTask, TakeSettings
from viewer.model.layout import MARGIN, STRIP_GAP, Layout
from viewer.model.state.app_state import AppState, Notice
from viewer.model.state.saving import CancelSaveTask, Saving
from viewer.ui.style import Palette, palette_of

NOTICE_WIDTH = 420.0
LEAST_HEIGHT = 40.0
_FLAGS = (
    imgui.WindowFlags_.no_title_bar
    | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_nav
    | imgui.WindowFlags_.always_auto_resize
    | imgui.WindowFlags_.no_focus_on_appearing
)


def notices(state: AppState, layout: Layout) -> list[Action]:
    """Build the notices, the newest at the bottom; what was pressed comes back as actions."""
    if not state.notices and state.saving is None:
        return []
    margin = MARGIN * layout.ui_scale
    right, bottom = layout.panel.x - margin, layout.window.height - margin
    if layout.strip_across is not None and layout.strip_down is not None:
        right, bottom = layout.strip_down.x - STRIP_GAP * layout.ui_scale, layout.strip_across.y - margin / 2
    elif layout.status is not None:
        bottom = layout.status.y
    width = min(NOTICE_WIDTH * layout.ui_scale, right - margin)
    if width <= 0:
        return []
    palette = palette_of(state.preferences.theme)
    imgui.set_next_window_pos(imgui.ImVec2(margin, bottom), 0, imgui.ImVec2(0, 1))
    most = max(bottom - margin / 2, LEAST_HEIGHT * layout.ui_scale)
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, most))
    imgui.begin("notices", None, _FLAGS)
    actions = _saving(state.saving, layout) if state.saving is not None else []
    actions += [action for i, notice in enumerate(state.notices) for action in _notice(i, notice, palette)]
    imgui.end()
    return actions


def saving_text(saving: Saving) -> str:
    """What is being saved, and how far it is: "Drawing a.png, 23 %, 1 more to save"."""
    words = f"Drawing {saving.name}, {saving.drawn:.0%}".replace("%", " %")
    words = words if saving.drawn < 1 else f"Writing {saving.name}"
    return f"{words}, {saving.waiting} more to save" if saving.waiting else words


def _saving(saving: Saving, layout: Layout) -> list[Action]:
    """A bar, and a button as long as it can still be given up."""
    actions: list[Action] = []
    imgui.progress_bar(saving.drawn, imgui.ImVec2(-1, 4 * layout.ui_scale), "")
    if saving.drawn < 1:
        if imgui.button("Cancel##saving"):
            actions.append(DoTask(CancelSaveTask()))
        imgui.same_line()
    imgui.align_text_to_frame_padding()
    imgui.text_wrapped(saving_text(saving))
    return actions


def _notice(index: int, notice: Notice, palette: Palette) -> list[Action]:
    actions: list[Action] = [DismissNotice(notice)] if imgui.button(f"×##{index}") else []
    imgui.same_line()
    imgui.begin_group()
    imgui.align_text_to_frame_padding()
    imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*(palette.error if notice.is_error else palette.text)))
    imgui.text_wrapped(notice.text)
    imgui.pop_style_color()
    if notice.offer is not None and imgui.button(f"Use its settings##{index}"):
        actions.append(TakeSettings(notice.offer))
    imgui.end_group()
    return actions
