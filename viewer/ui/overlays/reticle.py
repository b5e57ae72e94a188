"""Overlays of the picture: the reticle under the pointer, brushes, and the handles of the tilted plane of focus."""

from __future__ import annotations

import math

from imgui_bundle import imgui

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import DEPTH_TOOLS
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from viewer.model.focal_plane import handle_points, place_of, sharp_disparity
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState, Hover
from viewer.model.state.depth import Tool
from viewer.model.state.lens import TiltHandles
from viewer.model.state.preferences import Units
from viewer.model.units import far_percent, metres, metres_text, relative_distance
from viewer.ui.style import DARK, Color, corners, pack_color

WORD_GAP = "  ·  "
RETICLE_RADIUS = 11.0
HANDLE_RADIUS = 8.0
SAMPLE_RADIUS = 6.0
SHARP_SHARE = 0.04
"""Distance from the plane of focus up to which a surface is called sharp, as a share of the scene's disparity."""


def overlays(state: AppState, layout: Layout) -> None:
    """Draw all overlays. Their colours do not follow the theme, as they lie on a photo."""
    scene, picture, frame = state.scene, layout.picture, layout.frame
    if scene is None or picture is None or frame is None:
        return
    draw = imgui.get_background_draw_list()
    draw.push_clip_rect(*corners(frame), True)
    if state.tilt_handles is not None:
        _draw_handles(state.tilt_handles, layout, picture)
    if state.brush.is_on and state.brush.tool != "select" and scene.plan is not None:
        _draw_sample(state, layout, picture)
        if state.hover is not None:
            _draw_brush(state.brush.radius, scene, state.hover, layout, picture, DARK.text)
            _draw_direction(state.brush.tool, scene, state.hover, layout, picture)
    elif state.gloss_brush.is_on and state.optics.gloss is not None and state.hover is not None:
        color = DARK.warning if state.gloss_brush.erases else DARK.text
        _draw_brush(state.gloss_brush.radius, scene, state.hover, layout, picture, color)
    elif state.hover is not None and state.hover.disparity is not None:
        _draw_reticle(state, scene, state.hover, layout, picture)
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


def _draw_reticle(state: AppState, scene: Scene, hover: Hover, layout: Layout, picture: Rect) -> None:
    """Draw a ring where a click would focus, with words beside it, within the picture."""
    draw, scale = imgui.get_background_draw_list(), layout.ui_scale
    x, y = _pointed_at(hover, scene, picture)
    radius, frame = RETICLE_RADIUS * scale, layout.frame or picture
    _ring(draw, x, y, radius, scale, pack_color(DARK.text))
    words = hover_text(state.optics, scene, hover, state.preferences.units)
    size, room = imgui.calc_text_size(words), 6 * scale
    left = x + radius + room if x + radius + 3 * room + size.x <= frame.x + frame.width else x - radius - size.x
    left = max(left - (room if left < x else 0), frame.x + room)
    top = min(max(y - size.y / 2, frame.y + room), frame.y + frame.height - size.y - room)
    corners = imgui.ImVec2(left - room, top - room / 2), imgui.ImVec2(left + size.x + room, top + size.y + room / 2)
    draw.add_rect_filled(*corners, pack_color(DARK.background, 0.72), 4 * scale)
    draw.add_text(imgui.ImVec2(left, top), pack_color(DARK.text), words)


def _pointed_at(hover: Hover, scene: Scene, picture: Rect) -> tuple[float, float]:
    """Return the place of the pointer in the window."""
    x = picture.x + (hover.x_px + 0.5) / scene.width * picture.width
    return x, picture.y + (hover.y_px + 0.5) / scene.height * picture.height


def _draw_brush(radius: float, scene: Scene, hover: Hover, layout: Layout, picture: Rect, color: Color) -> None:
    """Draw the reach of a brush around the pointer. radius: as a share of the photo's width."""
    draw, scale = imgui.get_background_draw_list(), layout.ui_scale
    place = _pointed_at(hover, scene, picture)
    _ring(draw, *place, max(radius * picture.width, 2 * scale), scale, pack_color(color))


def _draw_direction(tool: Tool, scene: Scene, hover: Hover, layout: Layout, picture: Rect) -> None:
    """Draw a plus or a minus for a brush that brings nearer or pushes away."""
    draw, scale, (x, y) = imgui.get_background_draw_list(), layout.ui_scale, _pointed_at(hover, scene, picture)
    arm, color = 4 * scale, pack_color(DARK.text)
    if tool in ("nearer", "farther"):
        draw.add_line(imgui.ImVec2(x - arm, y), imgui.ImVec2(x + arm, y), color, 1.5 * scale)
    if tool == "nearer":
        draw.add_line(imgui.ImVec2(x, y - arm), imgui.ImVec2(x, y + arm), color, 1.5 * scale)


def _draw_sample(state: AppState, layout: Layout, picture: Rect) -> None:
    """Draw a small ring where the brush takes its depth from; it moves with the surface there."""
    sample, eye, scene = state.brush.sample, state.optics.eye, state.scene
    if sample is None or scene is None or state.brush.tool not in DEPTH_TOOLS:
        return
    x = picture.x + (sample.place[0] - sample.disparity * eye.s / scene.width) * picture.width
    y = picture.y + (sample.place[1] - sample.disparity * eye.t / scene.height) * picture.height
    draw, scale = imgui.get_background_draw_list(), layout.ui_scale
    _ring(draw, x, y, SAMPLE_RADIUS * scale, scale, pack_color(DARK.accent))


def _draw_handles(handles: TiltHandles, layout: Layout, picture: Rect) -> None:
    """Draw a line between two knobs, along which the focus changes."""
    draw, scale = imgui.get_background_draw_list(), layout.ui_scale
    first, second = (imgui.ImVec2(*point) for point in handle_points(handles, picture))
    draw.add_line(first, second, pack_color((0, 0, 0, 1), 0.45), 4 * scale)
    draw.add_line(first, second, pack_color(DARK.text, 0.9), 1.5 * scale)
    for point in (first, second):
        draw.add_circle_filled(point, HANDLE_RADIUS * scale, pack_color((0, 0, 0, 1), 0.45))
        draw.add_circle_filled(point, (HANDLE_RADIUS - 1.5) * scale, pack_color(DARK.text))
        draw.add_circle_filled(point, (HANDLE_RADIUS - 4) * scale, pack_color(DARK.accent))


def _ring(draw: imgui.ImDrawList, x: float, y: float, radius: float, scale: float, color: int) -> None:
    """Draw a light ring in a dark one, which is visible on any background."""
    draw.add_circle(imgui.ImVec2(x, y), radius, pack_color((0, 0, 0, 1), 0.5), 0, 3.5 * scale)
    draw.add_circle(imgui.ImVec2(x, y), radius, color, 0, 1.5 * scale)
    draw.add_circle_filled(imgui.ImVec2(x, y), 1.5 * scale, color)
