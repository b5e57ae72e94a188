"""The newest notice, over the lower left of the picture, with buttons that take it away or do what it advises; the one
before comes up after it. Above it what is being saved, exported, downloaded.
"""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.model.actions import Action, DismissNotice, DismissNotices, DoTask, TakeSettings
from viewer.model.commands import BY_NAME
from viewer.model.free_camera import LeaveCamera
from viewer.model.layout import MARGIN, STRIP_GAP, Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import CancelExportTask, Exporting
from viewer.model.state.model_download import CancelGetTask, Downloading
from viewer.model.state.notices import Notice
from viewer.model.state.saving import CancelSaveTask, Saving
from viewer.ui.style import palette_of

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
    """Build the newest notice; what was pressed comes back as actions."""
    is_looking = state.free_progress is not None
    if not (state.notices or state.saving or state.exporting or state.downloading or is_looking):
        return []
    margin = MARGIN * layout.ui_scale
    right, bottom = layout.panel.x - margin, layout.window.height - margin
    if layout.strip_across is not None and layout.strip_down is not None:
        right, bottom = layout.strip_down.x - STRIP_GAP * layout.ui_scale, layout.strip_across.y - margin / 2
    elif layout.status is not None:
        bottom = layout.status.y
    elif layout.filmstrip is not None:
        bottom = layout.filmstrip.y - margin / 2
    width = min(NOTICE_WIDTH * layout.ui_scale, right - margin)
    if width <= 0:
        return []
    imgui.set_next_window_pos(imgui.ImVec2(margin, bottom), 0, imgui.ImVec2(0, 1))
    most = max(bottom - margin / 2, LEAST_HEIGHT * layout.ui_scale)
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, most))
    imgui.begin("notices", None, _FLAGS)
    actions = _saving(state.saving, layout) if state.saving is not None else []
    if state.free_progress is not None:
        actions += _looking(state.free_progress, layout)
    if state.exporting is not None:
        actions += _exporting(state.exporting, layout)
    if state.downloading is not None:
        actions += _downloading(state.downloading, layout)
    if state.notices:
        actions += _notice(state.notices[-1], state)
    imgui.end()
    return actions


def saving_text(saving: Saving) -> str:
    """What is being saved, and how far it is: "Drawing a.png, 23 %, 1 more to save"."""
    words = f"Drawing {saving.name}, {saving.drawn:.0%}".replace("%", " %")
    if saving.seconds_left is not None:
        words += f", {saving.seconds_left} s left"
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


def _looking(done: float, layout: Layout) -> list[Action]:
    """A bar, and a button that goes back to the views."""
    imgui.progress_bar(done, imgui.ImVec2(-1, 4 * layout.ui_scale), "")
    actions: list[Action] = [LeaveCamera()] if imgui.button("Cancel##looking") else []
    imgui.same_line()
    imgui.align_text_to_frame_padding()
    imgui.text_wrapped("Drawing what the photo hides")
    return actions


def exporting_text(exporting: Exporting) -> str:
    """What is being exported, and how far it is: "Exporting a.mp4: drawing frames, 23 %, 1 more to export"."""
    words = f"Exporting {exporting.name}"
    if exporting.doing:
        words += f": {exporting.doing}, {exporting.done:.0%}".replace("%", " %")
    return f"{words}, {exporting.waiting} more to export" if exporting.waiting else words


def _exporting(exporting: Exporting, layout: Layout) -> list[Action]:
    """A bar, and a button to give it up."""
    imgui.progress_bar(exporting.done, imgui.ImVec2(-1, 4 * layout.ui_scale), "")
    actions: list[Action] = [DoTask(CancelExportTask())] if imgui.button("Cancel##exporting") else []
    imgui.same_line()
    imgui.align_text_to_frame_padding()
    imgui.text_wrapped(exporting_text(exporting))
    return actions


def _downloading(downloading: Downloading, layout: Layout) -> list[Action]:
    """A bar, and a button to give it up."""
    share = downloading.done / max(downloading.total, 1)
    imgui.progress_bar(share, imgui.ImVec2(-1, 4 * layout.ui_scale), "")
    actions: list[Action] = [DoTask(CancelGetTask())] if imgui.button("Cancel##download") else []
    imgui.same_line()
    imgui.align_text_to_frame_padding()
    imgui.text_wrapped(f"Downloading {downloading.title}: {downloading.done:,} of {downloading.total:,} MB")
    return actions


def _notice(notice: Notice, state: AppState) -> list[Action]:
    """The notice, what it offers, and how many more there are."""
    palette, others = palette_of(state.preferences.theme), len(state.notices) - 1
    actions: list[Action] = [DismissNotice(notice)] if imgui.button("×") else []
    imgui.same_line()
    imgui.begin_group()
    imgui.align_text_to_frame_padding()
    imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*(palette.error if notice.is_error else palette.text)))
    imgui.text_wrapped(notice.text)
    imgui.pop_style_color()
    offers: list[tuple[str, Action]] = [(name, BY_NAME[name].action(state)) for name in notice.commands]
    offers += [("Use its settings", TakeSettings(notice.offer))] if notice.offer is not None else []
    offers += [(f"Close all ({others + 1})", DismissNotices())] if others else []
    actions += _buttons(offers)
    imgui.end_group()
    return actions


def _buttons(offers: list[tuple[str, Action]]) -> list[Action]:
    """Side by side, on as many lines as they need."""
    actions: list[Action] = []
    style = imgui.get_style()
    right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    for i, (words, action) in enumerate(offers):
        width = imgui.calc_text_size(words).x + 2 * style.frame_padding.x
        if i and imgui.get_item_rect_max().x + style.item_spacing.x + width <= right:
            imgui.same_line()
        if imgui.button(words):
            actions.append(action)
    return actions
