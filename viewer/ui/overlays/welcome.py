"""The start page in an empty window: drop a photo, open one, see the demo, or go on with a recent photo."""

from __future__ import annotations

from collections.abc import Mapping

from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Source
from viewer.model import opening
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME
from viewer.model.folder import Thumbnail
from viewer.model.layout import MARGIN, Layout
from viewer.ui.overlays.filmstrip import CELL_ASPECT, GAP, photo_cell, write_in_cell
from viewer.ui.overlays.prompt_rows import CARD_FLAGS, button_rows
from viewer.ui.panel import progress_text
from viewer.ui.style import palette_of
from viewer.ui.widgets import gap, quiet, scale

WIDTH, WIDTH_ALONE, MIN_WIDTH = 600.0, 360.0, 160.0
"""Width of the page with and without recent photos, and beside a wide panel, in window units at usual size."""
CELL_WIDTH = 130.0
"""Width of a recent photo, in window units at usual size: about, as a row is filled."""
MIN_IN_ROW, MAX_IN_ROW = 2, 4
HEADING_SIZE = 1.4
"""Size of the heading relative to the usual text."""
OFFERS = ("Open a photo…", "Open a folder…", "See the demo")
"""Names of the commands that the page offers."""


def recent_paths(state: AppState) -> tuple[str, ...]:
    """Return the paths of the recent photos that are shown."""
    return state.existing_recent if _is_shown(state) else ()


def welcome(state: AppState, layout: Layout, thumbnails: Mapping[str, Thumbnail | None]) -> list[Action]:
    """Build the page where the picture will be, while nothing is open or being read and no prompt is shown."""
    if not _is_shown(state):
        return []
    window, room = layout.window, layout.panel.x or layout.window.width
    usual, least = (WIDTH if state.recent else WIDTH_ALONE) * scale(), min(MIN_WIDTH * scale(), window.width)
    width = max(min(usual, room - 2 * MARGIN), least)
    imgui.set_next_window_pos(imgui.ImVec2(max(room, width) / 2, window.height / 2), 0, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0), imgui.ImVec2(width, window.height))
    imgui.begin("welcome", None, CARD_FLAGS)
    imgui.push_font(imgui.get_font(), HEADING_SIZE * imgui.get_style().font_size_base)
    imgui.text_wrapped("Drop a photo here")
    imgui.pop_font()
    gap()
    actions = button_rows([(name, BY_NAME[name].action(state)) for name in OFFERS])
    gap()
    quiet("You can also drop a folder of photos, or a light field.")
    actions += _recent(state, thumbnails)
    imgui.end()
    return actions


def _is_shown(state: AppState) -> bool:
    return state.scene is None and not progress_text(state.progress) and state.prompt is None


def _recent(state: AppState, thumbnails: Mapping[str, Thumbnail | None]) -> list[Action]:
    """Build the recent photos in rows; a click opens one. A photo without a picture shows its name."""
    paths, palette = recent_paths(state), palette_of(state.preferences.theme)
    if not paths:
        return []
    gap(6)
    quiet("Recent")
    actions: list[Action] = []
    start, space, room = imgui.get_cursor_screen_pos(), GAP * scale(), imgui.get_content_region_avail().x
    in_row = min(max(round(room / (CELL_WIDTH * scale())), MIN_IN_ROW), MAX_IN_ROW)
    width = (room - (in_row - 1) * space) / in_row
    height = width / CELL_ASPECT
    for i, (path, name) in enumerate(zip(paths, opening.names_of(paths))):
        row, column = divmod(i, in_row)
        cell = Rect(start.x + column * (width + space), start.y + row * (height + space), width, height)
        if photo_cell(cell, name, thumbnails.get(path), palette, tip=path):
            actions.append(do(opening.open_source, Source(path)))
        if thumbnails.get(path, False) is None:
            write_in_cell(cell, name, palette)
    return actions
