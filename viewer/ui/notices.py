"""Notices over the lower left of the picture, each with a button that takes it away."""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.actions import Action, DismissNotice
from viewer.layout import MARGIN, Layout
from viewer.state import AppState, Notice
from viewer.ui.style import ERROR_TEXT, TEXT

NOTICE_WIDTH = 420.0
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
    """Build the notices, the newest at the bottom; those dismissed come back as actions."""
    if not state.notices:
        return []
    margin = MARGIN * layout.ui_scale
    width = min(NOTICE_WIDTH * layout.ui_scale, layout.panel.x - 2 * margin)
    if width <= 0:
        return []
    imgui.set_next_window_pos(imgui.ImVec2(margin, layout.window.height - margin), 0, imgui.ImVec2(0, 1))
    imgui.set_next_window_size(imgui.ImVec2(width, 0))
    imgui.begin("notices", None, _FLAGS)
    dismissed = [notice for index, notice in enumerate(state.notices) if _notice(index, notice)]
    imgui.end()
    return [DismissNotice(notice) for notice in dismissed]


def _notice(index: int, notice: Notice) -> bool:
    """One notice; True when its button was pressed."""
    imgui.push_id(index)
    pressed = imgui.button("×")
    imgui.same_line()
    imgui.push_style_color(imgui.Col_.text, imgui.ImVec4(*(ERROR_TEXT if notice.is_error else TEXT)))
    imgui.text_wrapped(notice.text)
    imgui.pop_style_color()
    imgui.pop_id()
    return pressed
