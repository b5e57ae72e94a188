"""Small drawings of the aperture shapes."""

from __future__ import annotations

import math
from typing import Any

from imgui_bundle import imgui

from iibr_core.beyond.optics import ApertureShape
from viewer.ui.style import Palette, pack_color

SEGMENTS = 32
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
            draw.add_convex_poly_filled(_corners(shape, middle, radius), color)
        case "ring":
            inner = max(shape.ring_inner, 0.15)
            draw.add_circle(centre, radius * (1 + inner) / 2, color, SEGMENTS, radius * (1 - inner))
        case "cat_eye":
            draw.add_convex_poly_filled(_lens(middle, radius, 0.45), color)
        case "mask":
            _draw_mask(draw, shape, middle, radius, palette)


def _corners(shape: ApertureShape, middle: tuple[float, float], radius: float) -> list[Any]:
    """Return the polygon's corners, clockwise from the top."""
    turn = math.radians(shape.rotation_deg)
    angles = [turn + 2 * math.pi * i / shape.blades for i in range(shape.blades)]
    return [imgui.ImVec2(middle[0] + radius * math.sin(a), middle[1] - radius * math.cos(a)) for a in angles]


def _lens(middle: tuple[float, float], radius: float, cut: float) -> list[Any]:
    """Return the outline of two overlapping discs, leaning like the cat's eye in the upper right corner."""
    half = math.acos(cut)
    arcs = [(a, 0.0) for a in _steps(-half, half)] + [(a, math.pi) for a in _steps(-half, half)]
    points = []
    for angle, side in arcs:
        x, y = radius * (math.cos(angle) - cut), radius * math.sin(angle)
        lean = side - math.pi / 4
        points.append((x * math.cos(lean) - y * math.sin(lean), x * math.sin(lean) + y * math.cos(lean)))
    return [imgui.ImVec2(middle[0] + x, middle[1] + y) for x, y in points]


def _steps(low: float, high: float) -> list[float]:
    return [low + (high - low) * i / (SEGMENTS // 2) for i in range(SEGMENTS // 2)]


def _draw_mask(
    draw: imgui.ImDrawList, shape: ApertureShape, middle: tuple[float, float], radius: float, palette: Palette
) -> None:
    """Draw the mask in coarse cells, or a plus without a mask."""
    left, top, cell = middle[0] - radius, middle[1] - radius, 2 * radius / MASK_CELLS
    mask = shape.mask
    if mask is None:
        arm, thick = 0.6 * radius, max(0.12 * radius, 1.0)
        color = pack_color(palette.quiet)
        draw.add_line(imgui.ImVec2(middle[0] - arm, middle[1]), imgui.ImVec2(middle[0] + arm, middle[1]), color, thick)
        draw.add_line(imgui.ImVec2(middle[0], middle[1] - arm), imgui.ImVec2(middle[0], middle[1] + arm), color, thick)
        return
    for row in range(MASK_CELLS):
        for column in range(MASK_CELLS):
            y = min(int((row + 0.5) / MASK_CELLS * mask.rows), mask.rows - 1)
            x = min(int((column + 0.5) / MASK_CELLS * mask.columns), mask.columns - 1)
            corner = imgui.ImVec2(left + column * cell, top + row * cell)
            far = imgui.ImVec2(corner.x + cell, corner.y + cell)
            draw.add_rect_filled(corner, far, pack_color(palette.text, 0.85 * mask.values[y * mask.columns + x] / 255))
