"""The panel's section for gloss: the surface, its reflection, and the light, which is dragged on a ball."""

from __future__ import annotations

import math
from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.gloss.settings import (
    LIGHT_RADIUS_LIMITS_DEG,
    MAX_TOLERANCE,
    STROKE_RADIUS_LIMITS,
    Gloss,
    GlossLight,
    GlossSurface,
    Triple,
)
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.scene import Scene
from viewer.model import lens
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.lens import FIRST_GLOSS, GlossBrush
from viewer.ui.style import Palette, pack_color, palette_of
from viewer.ui.widgets import button, checkbox, choice, edit, gap, in_row, percent_slider, scale, slider, tooltip

BALL_SIDE = 96.0
FIRST_COLOR: Triple = (0.5, 0.5, 0.5)
BALL_RINGS = 24
MIN_TOWARDS = 0.05
"""Smallest z of the light's direction towards the viewer, so that it stays on the ball's near side."""
MAX_BRIGHTNESS = 10.0
GLOSS_TIP = "Makes a surface glossy. Highlights move over it with the viewpoint."
FAR_TIP = "Farther surfaces stay matt."
NEAR_TIP = "Nearer surfaces stay matt."
ROUGH_TIP = "From a mirror to a dull sheen."
REFLECTS_TIP = "Share of the light that is reflected: 4 % for plastics and varnish, 50 % and more for metals."
BALL_TIP = "Drag to move the light around the scene."
BRIGHT_TIP = "At × 1, white paper that faces the light is as bright as the photo's white."
TOOLS = (
    ("Mark", False, "Drag over the picture to make surfaces glossy. Esc puts the brush away."),
    ("Erase", True, "Drag over the picture to keep surfaces matt. Esc puts the brush away."),
)
"""Words of each brush tool, whether it erases, and its tip."""
SIZE_TIP = "Radius of the brush as a share of the photo's width. The wheel over the picture changes it, too."
ONLY_TIP = "Only surfaces under the brush strokes are glossy."


def gloss_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section. All rows are always there, greyed if unused, so that no row moves under a click."""
    is_glossy, gloss = state.optics.gloss is not None, state.optics.gloss or FIRST_GLOSS
    is_on = checkbox("Glossy surface", is_glossy, GLOSS_TIP)
    imgui.begin_disabled(not is_glossy)
    edited = replace(
        gloss,
        light=_light(gloss.light, palette_of(state.preferences.theme)),
        roughness=percent_slider("Roughness", gloss.roughness, ROUGH_TIP),
        reflectance=percent_slider("Reflects", gloss.reflectance, REFLECTS_TIP),
        surface=_surface(gloss.surface),
    )
    actions = edit(lens.set_gloss, gloss, edited) + _brush(state.gloss_brush, gloss)
    imgui.end_disabled()
    if is_on != is_glossy:
        return [do(lens.set_gloss, FIRST_GLOSS if is_on else None)]
    return actions if is_glossy else []


def _light(light: GlossLight, palette: Palette) -> GlossLight:
    """Build the ball and the sliders of the light; return the edited light."""
    direction, level = _ball(light, palette), max(light.color)
    new = slider("Brightness", level, (0.0, MAX_BRIGHTNESS), "× %.2f", BRIGHT_TIP)
    red, green, blue = (value / level * new if level > 0 else new for value in light.color)
    color = light.color if new == level else (red, green, blue)
    radius = slider("Light size", light.radius_deg, LIGHT_RADIUS_LIMITS_DEG, "%.1f°", is_logarithmic=True)
    return replace(light, direction=direction, color=color, radius_deg=radius)


def _ball(light: GlossLight, palette: Palette) -> Triple:
    """Draw a ball lit as the scene is; return the direction of the light, which follows a drag."""
    side, corner = BALL_SIDE * scale(), imgui.get_cursor_screen_pos()
    imgui.invisible_button("light ball", imgui.ImVec2(side, side))
    is_held = imgui.is_item_active()
    tooltip("" if is_held else BALL_TIP)
    radius, middle = side / 2, (corner.x + side / 2, corner.y + side / 2)
    _draw_ball(middle, radius, light.unit_direction[:2], palette)
    mouse = imgui.get_io().mouse_pos
    return _direction_at((mouse.x - middle[0]) / radius, (mouse.y - middle[1]) / radius) if is_held else light.direction


def _direction_at(x: float, y: float) -> Triple:
    """Return the direction of the light above a place (x, y) of a ball of radius 1, on its near side."""
    away = math.hypot(x, y)
    most = math.sqrt(1 - MIN_TOWARDS**2)
    if away > most:
        x, y = x / away * most, y / away * most
    return x, y, -math.sqrt(max(1 - x * x - y * y, 0.0))


def _draw_ball(middle: tuple[float, float], radius: float, lit: tuple[float, float], palette: Palette) -> None:
    """Draw discs that shrink and brighten towards the light."""
    draw = imgui.get_window_draw_list()
    for ring in range(BALL_RINGS):
        share = ring / BALL_RINGS
        place = imgui.ImVec2(middle[0] + share * lit[0] * radius, middle[1] + share * lit[1] * radius)
        grey = 0.16 + 0.55 * share**2
        draw.add_circle_filled(place, (1 - share) * radius, pack_color((grey, grey, grey, 1.0)), 48)
    knob = imgui.ImVec2(middle[0] + lit[0] * radius, middle[1] + lit[1] * radius)
    draw.add_circle_filled(knob, 0.11 * radius, pack_color(palette.accent), 24)
    draw.add_circle(knob, 0.11 * radius, pack_color(palette.panel), 24, 1.5)


def _surface(surface: GlossSurface) -> GlossSurface:
    """Build the controls for depth and colour; return the edited surface."""
    gap()
    only = checkbox("Only brush strokes", surface.strokes_only, ONLY_TIP)
    imgui.begin_disabled(surface.strokes_only)
    far = percent_slider("From far", surface.farthest, FAR_TIP)
    near = percent_slider("To near", surface.nearest, NEAR_TIP)
    if far != surface.farthest:
        near = max(near, far)
    edited = replace(_color(surface), strokes_only=only, farthest=min(far, near), nearest=near)
    imgui.end_disabled()
    return edited


def _color(surface: GlossSurface) -> GlossSurface:
    is_one, color = surface.color is not None, surface.color or FIRST_COLOR
    has_one = checkbox("Only one colour", is_one, "Only pixels near this colour are glossy.")
    imgui.begin_disabled(not is_one)
    is_changed, values = imgui.color_edit3("##gloss colour", list(color))
    tolerance = slider("Tolerance", surface.tolerance, (0.0, MAX_TOLERANCE), "%.2f")
    imgui.end_disabled()
    if is_changed:
        red, green, blue = (clamp(float(value), 0.0, 1.0) for value in values)
        color = red, green, blue
    return replace(surface, color=color if has_one else None, tolerance=tolerance)


def _brush(brush: GlossBrush, gloss: Gloss) -> list[Action]:
    """Build the brush tools; the active tool is lit, and pressing it again puts the brush away."""
    actions: list[Action] = []
    for (words, erases, tip), width in in_row((*TOOLS, ("Wipe", None, "Remove all strokes."))):
        if erases is None:
            if button(words, tip, bool(gloss.surface.strokes), width):
                actions.append(do(lens.set_gloss, replace(gloss, surface=replace(gloss.surface, strokes=()))))
            continue
        is_in_hand = brush.is_on and brush.erases == erases
        if choice(words, is_in_hand, (width, 0), tip):
            actions.append(do(lens.take_gloss_brush, replace(brush, erases=erases, is_on=not is_in_hand)))
    size = percent_slider("Brush size", brush.radius, SIZE_TIP, brush.is_on, STROKE_RADIUS_LIMITS, "%.1f %%", True)
    return actions + edit(lens.take_gloss_brush, brush, replace(brush, radius=size))
