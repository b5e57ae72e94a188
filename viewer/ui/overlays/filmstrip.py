"""A row of small pictures at the bottom: the photos of the folder, the open one framed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from viewer.model.actions import Action
from viewer.model.layout import Layout
from viewer.model.reducers.folder_reducer import filmstrip_range, place_of_photo
from viewer.model.state.app_state import AppState
from viewer.model.state.folder import ScrollFilmstrip, StepPhoto, Thumbnail
from viewer.ui.style import corners, pack_color, palette_of

CELL_ASPECT, ROOM = 1.5, 6.0
WORDS_SIZE = 0.85
"""Of words in a cell, against the usual text."""


def filmstrip_paths(state: AppState, layout: Layout) -> tuple[str, ...]:
    """Paths of the photos that are shown."""
    folder = state.folder
    if folder is None or layout.filmstrip is None:
        return ()
    shown = filmstrip_range(state, _count(layout.filmstrip, layout))
    return tuple(str(PurePath(folder.path) / folder.photos[i].name) for i in shown)


def filmstrip(state: AppState, layout: Layout, thumbnails: Mapping[str, Thumbnail | None]) -> list[Action]:
    """Build the row; a click opens a photo, the wheel goes on in the folder. What cannot be read has its name."""
    rect, folder = layout.filmstrip, state.folder
    if rect is None or folder is None:
        return []
    actions: list[Action] = []
    imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
    imgui.set_next_window_size(imgui.ImVec2(rect.width, rect.height))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
    imgui.begin("filmstrip", None, flags | imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_bring_to_front_on_focus)
    shown = filmstrip_range(state, _count(rect, layout))
    place = place_of_photo(folder, state.source)
    room = ROOM * layout.ui_scale
    height, width = rect.height - 2 * room, (rect.height - 2 * room) * CELL_ASPECT
    left = rect.x + (rect.width - len(shown) * (width + room) + room) / 2
    for number, i in enumerate(shown):
        cell = Rect(left + number * (width + room), rect.y + room, width, height)
        name = folder.photos[i].name
        path = str(PurePath(folder.path) / name)
        thumbnail = thumbnails.get(path)
        does_open = name not in folder.unreadable
        if _cell(cell, name, thumbnail, i == place, state, layout) and place is not None and does_open:
            actions.append(StepPhoto(i - place))
        if thumbnail is None and (path in thumbnails or not does_open):
            _write(cell, f"Cannot be read: {name}", state)
    wheel = imgui.get_io().mouse_wheel if imgui.is_window_hovered() else 0.0
    if wheel:
        actions.append(ScrollFilmstrip(-round(wheel) or (-1 if wheel > 0 else 1)))
    imgui.end()
    imgui.pop_style_var()
    return actions


def _count(rect: Rect, layout: Layout) -> int:
    room = ROOM * layout.ui_scale
    return int((rect.width - room) // ((rect.height - 2 * room) * CELL_ASPECT + room))


def _write(cell: Rect, words: str, state: AppState) -> None:
    """Words in a cell, as far as they fit."""
    size = WORDS_SIZE * imgui.get_font_size()
    corner, width = imgui.ImVec2(cell.x + size / 3, cell.y + size / 3), cell.width - size * 2 / 3
    ends = imgui.ImVec4(cell.x, cell.y, cell.x + cell.width, cell.y + cell.height)
    color = pack_color(palette_of(state.preferences.theme).text)
    imgui.get_window_draw_list().add_text(imgui.get_font(), size, corner, color, words, width, ends)


def _cell(cell: Rect, name: str, thumbnail: Thumbnail | None, is_open: bool, state: AppState, layout: Layout) -> bool:
    """The picture as large as it fits, a plain ground before it is read. Whether it was clicked."""
    palette, draw, scale = palette_of(state.preferences.theme), imgui.get_window_draw_list(), layout.ui_scale
    corner, far = corners(cell)
    imgui.set_cursor_screen_pos(corner)
    pressed = imgui.invisible_button(f"photo {name}", imgui.ImVec2(cell.width, cell.height))
    is_hovered = imgui.is_item_hovered()
    draw.add_rect_filled(corner, far, pack_color(palette.frame), 3 * scale)
    if thumbnail is not None:
        width = min(cell.width, cell.height * thumbnail.aspect)
        height = width / thumbnail.aspect
        x, y = cell.x + (cell.width - width) / 2, cell.y + (cell.height - height) / 2
        uv = imgui.ImVec2(*thumbnail.low), imgui.ImVec2(*thumbnail.high)
        draw.add_image(imgui.ImTextureRef(thumbnail.texture), *corners(Rect(x, y, width, height)), *uv)
    if is_open or is_hovered:
        color = pack_color(palette.accent if is_open else palette.quiet)
        draw.add_rect(corner, far, color, 3 * scale, (3 if is_open else 1.5) * scale)
    if is_hovered:
        imgui.set_tooltip(name)
    return bool(pressed)
