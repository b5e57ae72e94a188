"""Small drawings of the aperture shapes."""

from __future__ import annotations

import math
from typing import Any

from imgui_bundle import imgui

from iibr_core.beyond.optics import ApertureShape
from iibr_core.scenes.rect import Rect
from viewer.ui.style import Palette, corners, pack_color

SEGMENTS = 32
SIDE_STEPS = 4
"""Number of lines along a side of a polygon, which may be round."""
MASK_CELLS = 6


def draw_shape(shape: ApertureShape, middle: tuple[float, float], radius: float, palette: Palette) -> None:
    """Draw the opening into the current window around a point (window units)."""
    draw = imgui.get_window_draw_list()
    color = pack_color(palette.text, 0.85)
    centre = imgui.ImVec2(*middle)
    match shape.kind:
        case "disc":
            draw.add_circle_filled(centre, radius, color, SEGMENTS)
        case "polygon":
            draw.add_convex_poly_filled(_outline(shape, middle, radius), color)
        case "ring":
            inner = max(shape.ring_inner, 0.15)
            draw.add_circle(centre, radius * (1 + inner) / 2, color, SEGMENTS, radius * (1 - inner))
        case "cat_eye":
            draw.add_convex_poly_filled(_lens(middle, radius, 0.45), color)
        case "mask":
            _draw_mask(shape, middle, radius, palette)


def _outline(shape: ApertureShape, middle: tuple[float, float], radius: float) -> list[Any]:
    """Return the outline of a polygon, clockwise from its corner on top; see `aperture_shape.opening`."""
    half, turn, bend, points = math.pi / shape.blades, math.radians(shape.rotation_deg), shape.roundness, []
    for i in range(shape.blades * SIDE_STEPS):
        beside = half * (2 * (i % SIDE_STEPS) / SIDE_STEPS - 1)  # angle from the middle of the side
        reach = radius * ((1 - bend) * math.cos(half) + bend) / ((1 - bend) * math.cos(beside) + bend)
        angle = turn + 2 * half * i / SIDE_STEPS
        points.append(imgui.ImVec2(middle[0] + reach * math.sin(angle), middle[1] - reach * math.cos(angle)))
    return points


def _lens(middle: tuple[float, float], radius: float, cut: float) -> list[Any]:
    """Return the outline of two overlapping discs, leaning like the cat's eye in the upper right corner."""
    half, points = math.acos(cut), []
    for lean in (-math.pi / 4, 3 * math.pi / 4):
        for step in range(SEGMENTS // 2):
            angle = half * (4 * step / SEGMENTS - 1)
            x, y = radius * (math.cos(angle) - cut), radius * math.sin(angle)
            right, down = x * math.cos(lean) - y * math.sin(lean), x * math.sin(lean) + y * math.cos(lean)
            points.append(imgui.ImVec2(middle[0] + right, middle[1] + down))
    return points


def _draw_mask(shape: ApertureShape, middle: tuple[float, float], radius: float, palette: Palette) -> None:
    """Draw the mask in coarse cells, or a plus without a mask."""
    draw, mask, (x, y) = imgui.get_window_draw_list(), shape.mask, middle
    if mask is None:
        arm, thick, color = 0.6 * radius, max(0.12 * radius, 1.0), pack_color(palette.quiet)
        draw.add_line(imgui.ImVec2(x - arm, y), imgui.ImVec2(x + arm, y), color, thick)
        draw.add_line(imgui.ImVec2(x, y - arm), imgui.ImVec2(x, y + arm), color, thick)
        return
    cell = 2 * radius / MASK_CELLS
    for row in range(MASK_CELLS):
        for column in range(MASK_CELLS):
            down, right = (int((i + 0.5) / MASK_CELLS * n) for i, n in ((row, mask.rows), (column, mask.columns)))
            color = pack_color(palette.text, 0.85 * mask.values[down * mask.columns + right] / 255)
            place = Rect(x - radius + column * cell, y - radius + row * cell, cell, cell)
            draw.add_rect_filled(*corners(place), color)
