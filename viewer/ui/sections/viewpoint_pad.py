"""The viewpoint pad: a map of the grid of views, with a knob to drag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from imgui_bundle import imgui

from iibr_core.scenes.lens_limits import clamp, eye_limits
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape, ViewOffset
from viewer.model import lens
from viewer.model.action import Action
from viewer.model.app_state import AppState
from viewer.ui.style import corners, pack_color, palette_of
from viewer.ui.widgets import edit, scale

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


def pad(state: AppState, scene: Scene) -> list[Action]:
    """Build the pad; dragging in it moves the viewpoint."""
    side, corner = PAD_SIDE * scale(), imgui.get_cursor_screen_pos()
    imgui.invisible_button("pad", imgui.ImVec2(side, side))
    chart = pad_map(Rect(corner.x, corner.y, side, side), scene.grid, EDGE * scale())
    _draw(state, scene.grid, chart)
    mouse = imgui.get_io().mouse_pos
    return edit(lens.move_eye, state.optics.eye, chart.eye(mouse.x, mouse.y)) if imgui.is_item_active() else []


def _draw(state: AppState, grid: GridShape, chart: PadMap) -> None:
    """Draw the area between the outermost views, a dot for every view, faint until it is made, and the knob."""
    draw, palette, eye = (
        imgui.get_window_draw_list(),
        palette_of(state.preferences.theme),
        chart.point(state.optics.eye),
    )
    draw.add_rect_filled(*corners(chart.rect), pack_color(palette.frame), 4 * scale())
    draw.push_clip_rect(*corners(chart.rect), True)
    left, top = chart.point(grid.offset(0, 0))
    right, bottom = chart.point(grid.offset(grid.rows - 1, grid.columns - 1))
    room = 4 * scale()
    stored = Rect(left - room, top - room, right - left + 2 * room, bottom - top + 2 * room)
    draw.add_rect_filled(*corners(stored), pack_color(palette.frame_hovered), 3 * scale())
    radius = clamp(0.16 * chart.units_per_view, 0.75 * scale(), 2.5 * scale())
    known, missing = pack_color(palette.quiet), pack_color(palette.quiet, 0.28)
    for view in np.ndindex(grid.rows, grid.columns):
        place = imgui.ImVec2(*chart.point(grid.offset(*view)))
        draw.add_circle_filled(place, radius, known if view in state.views_there else missing, 8)
    draw.add_circle_filled(imgui.ImVec2(*eye), 6 * scale(), pack_color(palette.accent))
    draw.add_circle(imgui.ImVec2(*eye), 6 * scale(), pack_color(palette.panel), 0, 1.5 * scale())
    draw.pop_clip_rect()
