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
from iibr_core.scenes.scene import Scene
from viewer.model import lens
from viewer.model.action import Action, do
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.lens import FIRST_GLOSS, GlossBrush
from viewer.ui.style import Palette, pack_color, palette_of
from viewer.ui.widgets import button, checkbox, choice, gap, percent_slider, slider, tooltip

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
MARK_TIP = "Drag over the picture to make surfaces glossy. Esc puts the brush away."
ERASE_TIP = "Drag over the picture to keep surfaces matt. Esc puts the brush away."
ONLY_TIP = "Only surfaces under the brush strokes are glossy."


def gloss_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section. All rows are always there, greyed if unused, so that no row moves under a click."""
    is_glossy, gloss = state.optics.gloss is not None, state.optics.gloss or FIRST_GLOSS
    is_on = checkbox("Glossy surface", is_glossy, layout, GLOSS_TIP)
    imgui.begin_disabled(not is_glossy)
    light = _light(gloss.light, layout, palette_of(state.preferences.theme))
    edited = _reflection(replace(gloss, light=light), layout)
    edited = replace(edited, surface=_surface(gloss.surface, layout))
    actions: list[Action] = [] if edited == gloss else [do(lens.set_gloss, edited)]
    actions += _brush(state.gloss_brush, gloss, layout)
    imgui.end_disabled()
    if is_on is not None:
        return [do(lens.set_gloss, FIRST_GLOSS if is_on else None)]
    return actions if is_glossy else []


def _light(light: GlossLight, layout: Layout, palette: Palette) -> GlossLight:
    """Build the ball and the sliders of the light; return the edited light."""
    direction = _ball(light, layout, palette)
    if direction is not None:
        light = replace(light, direction=direction)
    level = max(light.color)
    new = slider("Brightness", level, (0.0, MAX_BRIGHTNESS), "× %.2f", layout, BRIGHT_TIP)
    if new is not None:
        red, green, blue = (value / level * new if level > 0 else new for value in light.color)
        light = replace(light, color=(red, green, blue))
    radius = slider("Light size", light.radius_deg, LIGHT_RADIUS_LIMITS_DEG, "%.1f°", layout, is_logarithmic=True)
    return light if radius is None else replace(light, radius_deg=radius)


def _ball(light: GlossLight, layout: Layout, palette: Palette) -> Triple | None:
    """Draw a ball lit as the scene is; return the new direction if it is dragged."""
    side = BALL_SIDE * layout.ui_scale
    corner = imgui.get_cursor_screen_pos()
    imgui.invisible_button("light ball", imgui.ImVec2(side, side))
    is_held = imgui.is_item_active()
    tooltip("" if is_held else BALL_TIP, layout)
    radius, middle = side / 2, (corner.x + side / 2, corner.y + side / 2)
    x, y, _ = light.unit_direction
    _draw_ball(middle, radius, (x, y), palette)
    if not is_held:
        return None
    mouse = imgui.get_io().mouse_pos
    return _direction_at((mouse.x - middle[0]) / radius, (mouse.y - middle[1]) / radius)


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


def _reflection(gloss: Gloss, layout: Layout) -> Gloss:
    roughness = percent_slider("Roughness", gloss.roughness, layout, ROUGH_TIP)
    gloss = gloss if roughness is None else replace(gloss, roughness=roughness)
    share = percent_slider("Reflects", gloss.reflectance, layout, REFLECTS_TIP)
    return gloss if share is None else replace(gloss, reflectance=share)


def _surface(surface: GlossSurface, layout: Layout) -> GlossSurface:
    """Build the controls for depth and colour; return the edited surface."""
    gap(layout, 2)
    only = checkbox("Only brush strokes", surface.strokes_only, layout, ONLY_TIP)
    imgui.begin_disabled(surface.strokes_only)
    far = percent_slider("From far", surface.farthest, layout, FAR_TIP)
    if far is not None:
        surface = replace(surface, farthest=far, nearest=max(surface.nearest, far))
    near = percent_slider("To near", surface.nearest, layout, NEAR_TIP)
    if near is not None:
        surface = replace(surface, nearest=near, farthest=min(surface.farthest, near))
    surface = _color(surface, layout)
    imgui.end_disabled()
    return surface if only is None else replace(surface, strokes_only=only)


def _color(surface: GlossSurface, layout: Layout) -> GlossSurface:
    has_one, color = surface.color is not None, surface.color or FIRST_COLOR
    has_color = checkbox("Only one colour", has_one, layout, "Only pixels near this colour are glossy.")
    imgui.begin_disabled(not has_one)
    changed, values = imgui.color_edit3("##gloss colour", list(color))
    new = slider("Tolerance", surface.tolerance, (0.0, MAX_TOLERANCE), "%.2f", layout)
    imgui.end_disabled()
    if changed:
        red, green, blue = (min(max(float(value), 0.0), 1.0) for value in values)
        surface = replace(surface, color=(red, green, blue))
    surface = surface if new is None else replace(surface, tolerance=new)
    return surface if has_color is None else replace(surface, color=FIRST_COLOR if has_color else None)


def _brush(brush: GlossBrush, gloss: Gloss, layout: Layout) -> list[Action]:
    """Build the brush tools; the active tool is lit, and pressing it again puts the brush away."""
    actions: list[Action] = []
    spacing = 4 * layout.ui_scale
    width = (imgui.get_content_region_avail().x - 2 * spacing) / 3
    for label, erases, tip in (("Mark", False, MARK_TIP), ("Erase", True, ERASE_TIP)):
        is_in_hand = brush.is_on and brush.erases == erases
        if choice(label, is_in_hand, layout, (width, 0), tip):
            actions.append(do(lens.take_gloss_brush, replace(brush, erases=erases, is_on=not is_in_hand)))
        imgui.same_line(0, spacing)
    if button("Wipe", layout, "Remove all strokes.", bool(gloss.surface.strokes), width):
        actions.append(do(lens.set_gloss, replace(gloss, surface=replace(gloss.surface, strokes=()))))
    limits = (100 * STROKE_RADIUS_LIMITS[0], 100 * STROKE_RADIUS_LIMITS[1])
    tip = "Radius of the brush as a share of the photo's width. The wheel over the picture changes it, too."
    size = slider("Brush size", 100 * brush.radius, limits, "%.1f %%", layout, tip, True, brush.is_on)
    return actions + ([] if size is None else [do(lens.take_gloss_brush, replace(brush, radius=size / 100))])
