"""The filmstrip: a row of small pictures at the bottom, the photos of the folder, the open one framed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from viewer.model import folder, look
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.folder import Thumbnail
from viewer.model.layout import Layout
from viewer.ui.style import Palette, corners, pack_color, palette_of
from viewer.ui.widgets import FIXED, scale, tooltip

CELL_ASPECT = 1.5
GAP = 6.0
COPY_LOOK, PASTE_LOOK = "Copy the look of the open photo", "Paste the look to this photo"
"""Entries of a photo's menu."""
WORDS_SIZE = 0.85
"""Size of words in a cell relative to the usual text."""


def filmstrip_paths(state: AppState, layout: Layout) -> tuple[str, ...]:
    """Return the paths of the photos that are shown."""
    photos = state.folder
    if photos is None or layout.filmstrip is None:
        return ()
    shown = folder.filmstrip_range(state, _count(layout.filmstrip, layout))
    return tuple(str(PurePath(photos.path) / photos.photos[i].name) for i in shown)


def filmstrip(state: AppState, layout: Layout, thumbnails: Mapping[str, Thumbnail | None]) -> list[Action]:
    """Build the row: a click opens a photo, the right button its menu; the wheel scrolls.

    A photo that cannot be read shows its name.
    """
    rect, photos = layout.filmstrip, state.folder
    if rect is None or photos is None:
        return []
    imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
    imgui.set_next_window_size(imgui.ImVec2(rect.width, rect.height))
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(0, 0))
    imgui.begin("filmstrip", None, FIXED | imgui.WindowFlags_.no_scrollbar)
    actions: list[Action] = []
    shown, place = folder.filmstrip_range(state, _count(rect, layout)), folder.place_of_photo(photos, state.source)
    palette = palette_of(state.preferences.theme)
    for i, cell in zip(shown, _cells(rect, len(shown), layout)):
        name = photos.photos[i].name
        path = str(PurePath(photos.path) / name)
        thumbnail, is_readable = thumbnails.get(path), name not in photos.unreadable
        if photo_cell(cell, name, thumbnail, palette, i == place) and place is not None and is_readable:
            actions.append(do(folder.step, i - place))
        if place is not None:
            actions += _menu(cell, i - place, state)
        if thumbnail is None and (path in thumbnails or not is_readable):
            write_in_cell(cell, f"Cannot be read: {name}", palette)
    if imgui.is_window_hovered() and (wheel := imgui.get_io().mouse_wheel):
        actions.append(do(folder.scroll, -round(wheel) or (-1 if wheel > 0 else 1)))
    imgui.end()
    imgui.pop_style_var()
    return actions


def _menu(cell: Rect, steps: int, state: AppState) -> list[Action]:
    """Build the menu of a photo, which a click with the right button opens. steps: from the open photo to this one."""
    name, actions = f"menu {steps}", []
    if imgui.is_mouse_clicked(imgui.MouseButton_.right) and imgui.is_mouse_hovering_rect(*corners(cell)):
        imgui.open_popup(name)
    imgui.push_style_var(imgui.StyleVar_.window_padding, imgui.ImVec2(GAP * scale(), GAP * scale()))
    if imgui.begin_popup(name):
        if imgui.menu_item(COPY_LOOK, "", False, state.scene is not None)[0]:
            actions.append(do(look.copy_look))
        if imgui.menu_item(PASTE_LOOK, "", False, state.look is not None)[0]:
            actions.append(do(look.paste_look_to, steps))
        imgui.end_popup()
    imgui.pop_style_var()
    return actions


def _cells(rect: Rect, count: int, layout: Layout) -> list[Rect]:
    """Return the places of the photos, in the middle of the row."""
    width, height, gap = _cell_size(rect, layout)
    left = rect.x + (rect.width - count * (width + gap) + gap) / 2
    return [Rect(left + i * (width + gap), rect.y + gap, width, height) for i in range(count)]


def _cell_size(rect: Rect, layout: Layout) -> tuple[float, float, float]:
    """Return width and height of a cell, and the gap between cells."""
    gap = GAP * layout.ui_scale
    return (rect.height - 2 * gap) * CELL_ASPECT, rect.height - 2 * gap, gap


def _count(rect: Rect, layout: Layout) -> int:
    width, _, gap = _cell_size(rect, layout)
    return int((rect.width - gap) // (width + gap))


def write_in_cell(cell: Rect, words: str, palette: Palette) -> None:
    """Draw words in a cell, as far as they fit."""
    size = WORDS_SIZE * imgui.get_font_size()
    corner, width = imgui.ImVec2(cell.x + size / 3, cell.y + size / 3), cell.width - size * 2 / 3
    ends = imgui.ImVec4(cell.x, cell.y, cell.x + cell.width, cell.y + cell.height)
    draw, color = imgui.get_window_draw_list(), pack_color(palette.text)
    draw.add_text(imgui.get_font(), size, corner, color, words, width, ends)


def photo_cell(
    cell: Rect, name: str, thumbnail: Thumbnail | None, palette: Palette, is_open: bool = False, tip: str = ""
) -> bool:
    """Draw a photo as large as it fits; return whether it was clicked. tip: its tooltip, the name if there is none."""
    draw, rounding = imgui.get_window_draw_list(), 3 * scale()
    corner, far = corners(cell)
    imgui.set_cursor_screen_pos(corner)
    is_pressed = imgui.invisible_button(f"photo {tip or name}", imgui.ImVec2(cell.width, cell.height))
    draw.add_rect_filled(corner, far, pack_color(palette.frame), rounding)
    if thumbnail is not None:
        width = min(cell.width, cell.height * thumbnail.aspect)
        height = width / thumbnail.aspect
        place = Rect(cell.x + (cell.width - width) / 2, cell.y + (cell.height - height) / 2, width, height)
        draw.add_image(imgui.ImTextureRef(thumbnail.texture), *corners(place))
    if is_open or imgui.is_item_hovered():
        color = pack_color(palette.accent if is_open else palette.quiet)
        draw.add_rect(corner, far, color, rounding, rounding if is_open else rounding / 2)
    tooltip(tip or name)
    return bool(is_pressed)
