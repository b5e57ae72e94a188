"""Overlays of the picture: the reticle under the pointer, brushes, and the handles of the tilted plane of focus."""

from __future__ import annotations

import math

from imgui_bundle import imgui

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import DEPTH_TOOLS
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from viewer.model.app_state import AppState
from viewer.model.depth import Tool
from viewer.model.focal_plane import handle_points, place_of, sharp_disparity
from viewer.model.inspection import Hover
from viewer.model.layout import Layout
from viewer.model.lens import TiltHandles
from viewer.model.preferences import Units
from viewer.model.units import far_percent, metres, metres_text, relative_distance
from viewer.ui.style import DARK, WORDS_ROOM, Color, corners, draw_words, pack_color

WORD_GAP = "  ·  "
RETICLE_RADIUS = 11.0
HANDLE_RADIUS = 8.0
SAMPLE_RADIUS = 6.0
SHARP_SHARE = 0.04
"""Distance from the plane of focus up to which a surface is called sharp, as a share of the scene's disparity."""


def draw_marks(state: AppState, scene: Scene, layout: Layout, picture: Rect, frame: Rect) -> None:
    """Draw the marks over the picture. Their colours do not follow the theme, as they lie on a photo."""
    draw, hover, brush, scale = imgui.get_background_draw_list(), state.hover, state.brush, layout.ui_scale
    draw.push_clip_rect(*corners(frame), True)
    if state.tilt_handles is not None:
        _draw_handles(state.tilt_handles, scale, picture)
    if brush.is_on and scene.plan is not None:
        _draw_sample(state, scene, scale, picture)
        if hover is not None:
            x, y = _pointed_at(hover, scene, picture)
            _ring(x, y, max(brush.radius * picture.width, 2 * scale), scale, DARK.text)
            _draw_direction(brush.tool, x, y, scale)
    elif state.gloss_brush.is_on and state.optics.gloss is not None and hover is not None:
        color, radius = DARK.warning if state.gloss_brush.erases else DARK.text, state.gloss_brush.radius
        _ring(*_pointed_at(hover, scene, picture), max(radius * picture.width, 2 * scale), scale, color)
    elif hover is not None and hover.disparity is not None:
        _draw_reticle(state, scene, hover, scale, picture, frame)
    draw.pop_clip_rect()


def hover_text(optics: Optics, scene: Scene, hover: Hover, units: Units = "photographic") -> str:
    """Describe the surface under the pointer and its distance from the focus.

    "1.62 m · 0.38 m in front", "12 % in front", "sharp"; in units of light fields "1.24 px · × 0.80 · 0.36 in front".
    """
    assert hover.disparity is not None
    sharp = sharp_disparity(optics, place_of(hover.x_px, hover.y_px, scene))
    ahead, (far, near) = hover.disparity - sharp, scene.disparity_range_px
    is_sharp = abs(ahead) <= max(optics.focus_range, SHARP_SHARE * (near - far))
    side = "in front" if ahead > 0 else "behind"
    if units == "photographic":
        return _distance_words(scene, hover.disparity, sharp, is_sharp, side)
    words, distance = [f"{hover.disparity:.2f} px"], relative_distance(scene, hover.disparity)
    words += [] if distance is None else [f"× {distance:.2f}"]
    words.append("sharp" if is_sharp else f"{abs(ahead):.2f} {side}")
    return WORD_GAP.join(words).replace("-", "−")


def _distance_words(scene: Scene, disparity: float, sharp: float, is_sharp: bool, side: str) -> str:
    """Return the distance and its difference from the focus, in metres or in per cent of the range from near to far."""
    here, focus = metres(scene, disparity), metres(scene, sharp)
    if here is None or focus is None:
        percent = abs(far_percent(scene, disparity) - far_percent(scene, sharp))
        return "sharp" if is_sharp else f"{percent:.0f} % {side}"
    if is_sharp:
        return f"{metres_text(here)}{WORD_GAP}sharp"
    away = "far" if math.isinf(here) or math.isinf(focus) else metres_text(abs(here - focus))
    return f"{metres_text(here)}{WORD_GAP}{away} {side}"


def _draw_reticle(state: AppState, scene: Scene, hover: Hover, scale: float, picture: Rect, frame: Rect) -> None:
    """Draw a ring where a click would focus, with words beside it, within the picture."""
    x, y = _pointed_at(hover, scene, picture)
    radius, line, room = RETICLE_RADIUS * scale, imgui.get_text_line_height(), 6 * scale
    _ring(x, y, radius, scale, DARK.text)
    words = hover_text(state.optics, scene, hover, state.preferences.units)
    width = imgui.calc_text_size(words).x + 2 * WORDS_ROOM * scale
    is_right = x + radius + 2 * room + width <= frame.x + frame.width
    left = x + radius + room if is_right else max(x - radius - room - width, frame.x + room)
    draw_words(words, left, clamp(y - line / 2, frame.y, frame.y + frame.height - line - room), scale)


def _pointed_at(hover: Hover, scene: Scene, picture: Rect) -> tuple[float, float]:
    """Return the place of the pointer in the window."""
    x = picture.x + (hover.x_px + 0.5) / scene.width * picture.width
    return x, picture.y + (hover.y_px + 0.5) / scene.height * picture.height


def _draw_direction(tool: Tool, x: float, y: float, scale: float) -> None:
    """Draw a plus or a minus for a brush that brings nearer or pushes away."""
    draw, arm, color = imgui.get_background_draw_list(), 4 * scale, pack_color(DARK.text)
    if tool in ("nearer", "farther"):
        draw.add_line(imgui.ImVec2(x - arm, y), imgui.ImVec2(x + arm, y), color, 1.5 * scale)
    if tool == "nearer":
        draw.add_line(imgui.ImVec2(x, y - arm), imgui.ImVec2(x, y + arm), color, 1.5 * scale)


def _draw_sample(state: AppState, scene: Scene, scale: float, picture: Rect) -> None:
    """Draw a small ring where the brush takes its depth from; it moves with the surface there."""
    sample, eye = state.brush.sample, state.optics.eye
    if sample is None or state.brush.tool not in DEPTH_TOOLS:
        return
    x = picture.x + (sample.place[0] - sample.disparity * eye.s / scene.width) * picture.width
    y = picture.y + (sample.place[1] - sample.disparity * eye.t / scene.height) * picture.height
    _ring(x, y, SAMPLE_RADIUS * scale, scale, DARK.accent)


def _draw_handles(handles: TiltHandles, scale: float, picture: Rect) -> None:
    """Draw a line between two knobs, along which the focus changes."""
    draw, ends = imgui.get_background_draw_list(), [imgui.ImVec2(*point) for point in handle_points(handles, picture)]
    draw.add_line(ends[0], ends[1], pack_color((0, 0, 0, 1), 0.45), 4 * scale)
    draw.add_line(ends[0], ends[1], pack_color(DARK.text, 0.9), 1.5 * scale)
    for point in ends:
        draw.add_circle_filled(point, HANDLE_RADIUS * scale, pack_color((0, 0, 0, 1), 0.45))
        draw.add_circle_filled(point, (HANDLE_RADIUS - 1.5) * scale, pack_color(DARK.text))
        draw.add_circle_filled(point, (HANDLE_RADIUS - 4) * scale, pack_color(DARK.accent))


def _ring(x: float, y: float, radius: float, scale: float, color: Color) -> None:
    """Draw a light ring in a dark one, which is visible on any background."""
    draw, middle = imgui.get_background_draw_list(), imgui.ImVec2(x, y)
    draw.add_circle(middle, radius, pack_color((0, 0, 0, 1), 0.5), 0, 3.5 * scale)
    draw.add_circle(middle, radius, pack_color(color), 0, 1.5 * scale)
    draw.add_circle_filled(middle, 1.5 * scale, pack_color(color))
