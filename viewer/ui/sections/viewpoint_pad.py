"""The viewpoint pad: a map of the grid of views, with a knob to drag."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from iibr_core.scenes.lens_limits import eye_limits
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape, ViewOffset
from viewer.model import lens
from viewer.model.action import Action, do
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.ui.style import Palette, corners, pack_color, palette_of

PAD_SIDE = 136.0
EDGE = 7.0
"""Margin around the map, in window units at usual size."""


@dataclass(frozen=True)
class PadMap:
    """Map between view offsets and window units. middle: view offset at the pad's middle."""

    rect: Rect
    middle: ViewOffset
    units_per_view: float

    def point(self, eye: ViewOffset) -> tuple[float, float]:
        """Return the place of a view offset on the pad."""
        x = self.rect.x + self.rect.width / 2 + (eye.s - self.middle.s) * self.units_per_view
        return x, self.rect.y + self.rect.height / 2 + (eye.t - self.middle.t) * self.units_per_view

    def eye(self, x: float, y: float) -> ViewOffset:
        """Return the view offset at a place; the inverse of `point`."""
        s = self.middle.s + (x - self.rect.x - self.rect.width / 2) / self.units_per_view
        return ViewOffset(self.middle.t + (y - self.rect.y - self.rect.height / 2) / self.units_per_view, s)


def pad_map(rect: Rect, grid: GridShape, edge: float) -> PadMap:
    """Return the map that shows every allowed viewpoint, with square steps."""
    (top, bottom), (left, right) = eye_limits(grid.rows), eye_limits(grid.columns)
    widest = max(bottom - top, right - left)
    return PadMap(rect, ViewOffset((top + bottom) / 2, (left + right) / 2), (rect.width - 2 * edge) / widest)


def pad(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the pad; dragging in it moves the viewpoint."""
    side = PAD_SIDE * layout.ui_scale
    corner = imgui.get_cursor_screen_pos()
    imgui.invisible_button("pad", imgui.ImVec2(side, side))
    chart = pad_map(Rect(corner.x, corner.y, side, side), scene.grid, EDGE * layout.ui_scale)
    _draw(state, scene.grid, chart, layout.ui_scale)
    if not imgui.is_item_active():
        return []
    mouse = imgui.get_io().mouse_pos
    eye = chart.eye(mouse.x, mouse.y)
    return [do(lens.move_eye, eye)] if eye != state.optics.eye else []


def _draw(state: AppState, grid: GridShape, chart: PadMap, scale: float) -> None:
    draw, rect, palette = imgui.get_window_draw_list(), chart.rect, palette_of(state.preferences.theme)
    draw.add_rect_filled(*corners(rect), pack_color(palette.frame), 4 * scale)
    draw.push_clip_rect(*corners(rect), True)
    _draw_stored(draw, grid, chart, scale, palette)
    _draw_views(draw, state.views_there, grid, chart, scale, palette)
    x, y = chart.point(state.optics.eye)
    draw.add_circle_filled(imgui.ImVec2(x, y), 6 * scale, pack_color(palette.accent))
    draw.add_circle(imgui.ImVec2(x, y), 6 * scale, pack_color(palette.panel), 0, 1.5 * scale)
    draw.pop_clip_rect()


def _draw_stored(draw: imgui.ImDrawList, grid: GridShape, chart: PadMap, scale: float, palette: Palette) -> None:
    """Draw the area between the outermost views."""
    left, top = chart.point(grid.offset(0, 0))
    right, bottom = chart.point(grid.offset(grid.rows - 1, grid.columns - 1))
    room = 4 * scale
    ends = imgui.ImVec2(left - room, top - room), imgui.ImVec2(right + room, bottom + room)
    draw.add_rect_filled(*ends, pack_color(palette.frame_hovered), 3 * scale)


def _draw_views(
    draw: imgui.ImDrawList,
    there: frozenset[tuple[int, int]],
    grid: GridShape,
    chart: PadMap,
    scale: float,
    palette: Palette,
) -> None:
    """Draw a dot for every view, faint until it is made."""
    radius = min(max(0.16 * chart.units_per_view, 0.75 * scale), 2.5 * scale)
    known, missing = pack_color(palette.quiet), pack_color(palette.quiet, 0.28)
    for row in range(grid.rows):
        for column in range(grid.columns):
            x, y = chart.point(grid.offset(row, column))
            color = known if (row, column) in there else missing
            draw.add_circle_filled(imgui.ImVec2(x, y), radius, color, 8)
