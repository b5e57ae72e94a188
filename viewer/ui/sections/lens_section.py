"""The sliders of focus and aperture, and the panel's sections for focus, aperture and light."""

from __future__ import annotations

import math
from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.beyond.optics import EXPOSURE_LIMIT_STOPS, RING_INNER_LIMIT, ApertureKind, ApertureShape
from iibr_core.scenes.f_numbers import ASSUMED_DISTANCE_M, f_number
from iibr_core.scenes.lens_choice import TURNED
from iibr_core.scenes.lens_limits import BLADES_LIMITS, aperture_limit, clamp, focus_limits, focus_span
from iibr_core.scenes.scene import Scene
from viewer.model import lens, units
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.tasks import ChooseTask, ask
from viewer.ui.sections.aperture_icons import draw_shape
from viewer.ui.style import Palette, palette_of
from viewer.ui.widgets import button, checkbox, choice, depth_slider, edit, in_row, percent_slider, quiet, scale, slider

FOCUS_TIP = "Distance that is sharp, from near to far. You can also click in the picture or turn the wheel."
FOCUS_DISPARITY_TIP = "Disparity that is sharp, in pixels per view step. Larger is closer."
DISTANCE_TIP = "Distance that is sharp. 1 is the plane that stays still while the viewpoint moves."
RANGE_TIP = "Depth before and behind the focus that is also sharp."
APERTURE_TIP = "Opening of the lens. A wider opening blurs everything out of focus more."
F_NUMBER_TIP = " The f-number is that of a full-frame lens that is focused at {:.0f} m."
METRIC_TIP = " The f-number is that of a full-frame lens with the photo's angle of view, by the distances in metres."
EQUIVALENT_TIP = " ≈ f/2 means: an 85 mm full-frame lens, focused at 2 m, blurs the background as much at f/2."
ALL_SHARP = "all sharp"
"""F-number of a pinhole."""
SHAPE_HEIGHT = 32.0
"""Height of the buttons of aperture shapes, in window units at usual size."""
CLOSED_STOPS = 6.0
"""Length of the aperture's slider in stops, from the widest to a pinhole."""
TILT_TIP = "Shows two handles in the picture. Drag them onto two objects to make both sharp, and all between."
HIGHLIGHT_TIP = "Glow of bright spots, such as lamps, that are out of focus."
ROUNDNESS_TIP = "How round the sides between the blades are. At 100 % the opening is a disc."
KIND_TIPS: dict[ApertureKind, str] = {
    "disc": "Disc",
    "polygon": "Blades",
    "ring": "Ring, like a mirror lens",
    "cat_eye": "Cat's eye: cut off toward the picture's corners",
    "mask": "Your own grey image",
}


def focus_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section: the focus as a distance if it is known, range, tilt."""
    optics, span = state.optics, focus_span(scene)
    (right, down), is_tilted = optics.focus_tilt, state.tilt_handles is not None or any(optics.focus_tilt)
    is_in_px = state.preferences.units == "light field"
    actions = _distance(state, scene) if is_in_px else []
    unit, form = (1.0, "%.2f px") if is_in_px else (span / 100, "%.0f %%")
    words = f"± {form}" if optics.focus_range else "none"
    focus_range = slider("Range", optics.focus_range, (0.0, span), words, RANGE_TIP, unit=unit)
    actions += edit(lens.set_focus_range, optics.focus_range, focus_range)
    if checkbox("Tilt", is_tilted, TILT_TIP) != is_tilted:
        actions.append(do(lens.show_tilt_handles, not is_tilted))
        actions += [do(lens.set_focus_tilt, (0.0, 0.0))] if is_tilted else []
    signed, limits = form.replace("%", "%+", 1), (-span, span)
    tilt = (
        slider("Tilt right", right, limits, signed, is_enabled=is_tilted, unit=unit),
        slider("Tilt down", down, limits, signed, is_enabled=is_tilted, unit=unit),
    )
    return actions + edit(lens.set_focus_tilt, optics.focus_tilt, tilt)


def focus_slider(state: AppState, scene: Scene) -> list[Action]:
    """Build the focus slider: from near to far, in metres if they are known; or as disparity."""
    disparity = state.optics.focus_disparity
    if state.preferences.units == "light field" or not scene.has_view_disparity:  # else nothing is near or far yet
        edited = slider("Focus", disparity, focus_limits(scene), "%.2f px", FOCUS_DISPARITY_TIP)
    else:
        distance = units.metres(scene, disparity)
        form = "%.0f %%" if distance is None else units.metres_text(distance)
        edited = depth_slider("Focus", disparity, focus_limits(scene), form, FOCUS_TIP)
    return edit(lens.set_focus, disparity, edited)


def _distance(state: AppState, scene: Scene) -> list[Action]:
    """Build the slider of the focus as a distance, if that is known."""
    limits = units.distance_limits(scene)
    distance = units.relative_distance(scene, state.optics.focus_disparity)
    if limits is None:
        return []
    shown = limits[1] if distance is None else clamp(distance, *limits)
    new = slider("Distance", shown, limits, "× %.2f", DISTANCE_TIP, is_logarithmic=True)
    disparity = None if new == shown else units.disparity_at(scene, new)
    return [] if disparity is None else [do(lens.set_focus, disparity)]


def aperture_slider(state: AppState, scene: Scene) -> list[Action]:
    """Build the aperture slider, in stops like the ring of a lens: a pinhole at the left, wide open at the right."""
    diameter, widest = state.optics.aperture_diameter, aperture_limit(scene)
    words, is_exact = units.f_number_text(scene, diameter), f_number(scene, widest) is not None
    exact_tip = METRIC_TIP if scene.inverse_metres is not None else F_NUMBER_TIP.format(ASSUMED_DISTANCE_M)
    tip = APERTURE_TIP + (exact_tip if is_exact else EQUIVALENT_TIP)
    if state.preferences.units == "light field":
        form = ALL_SHARP if diameter == 0 else f"%.1f views  ·  {words}"
        return edit(lens.set_aperture, diameter, slider("Aperture", diameter, (0.0, widest), form, tip))
    opened = 0.0 if diameter == 0 else max(CLOSED_STOPS - math.log2(widest / diameter), 0.0)
    stops = slider("Aperture", opened, (0.0, CLOSED_STOPS), ALL_SHARP if diameter == 0 else words, tip)
    if stops == opened:
        return []
    return [do(lens.set_aperture, widest * 2.0 ** (stops - CLOSED_STOPS) if stops > 0 else 0.0)]


def aperture_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section: the opening's shape and its numbers."""
    shape = state.optics.aperture_shape
    actions = _kinds(shape, palette_of(state.preferences.theme))
    if shape.kind == "mask":
        if button("Image…", "Choose a small grey image. White lets light through."):
            actions.append(do(ask, ChooseTask("mask")))
        if shape.mask is not None:
            imgui.same_line()
            imgui.align_text_to_frame_padding()
            quiet(shape.mask.name)
    return actions + edit(lens.set_aperture_shape, shape, _shape_rows(shape))


def _kinds(shape: ApertureShape, palette: Palette) -> list[Action]:
    """Build a row of buttons that show the shapes. The mask without an image opens a dialog."""
    actions: list[Action] = []
    height = SHAPE_HEIGHT * scale()
    for (kind, tip), width in in_row(tuple(KIND_TIPS.items())):
        corner = imgui.get_cursor_screen_pos()
        if choice(f"##{kind}", shape.kind == kind, (width, height), tip):
            needs_image = kind == "mask" and shape.mask is None
            chosen = do(lens.set_aperture_shape, replace(shape, kind=kind))
            actions.append(do(ask, ChooseTask("mask")) if needs_image else chosen)
        middle = corner.x + width / 2, corner.y + height / 2
        draw_shape(replace(shape, kind=kind), middle, 0.32 * height, palette)
    return actions


def _shape_rows(shape: ApertureShape) -> ApertureShape:
    """Build three rows for every shape, so that nothing below moves under a click; return the edited shape."""
    edited = shape
    if shape.kind in ("disc", "polygon"):
        blades = slider("Blades", shape.blades, BLADES_LIMITS, "%.0f", is_enabled=shape.kind == "polygon")
        edited = replace(shape, blades=round(blades))
    if shape.kind == "ring":
        blocked = slider("Blocked", shape.ring_inner, (0.0, RING_INNER_LIMIT), "%.2f of the radius")
        edited = replace(shape, ring_inner=blocked)
    if shape.kind == "cat_eye":
        edited = replace(shape, cat_eye=slider("Cut off", shape.cat_eye, (0.0, 1.0), "%.2f"))
    roundness = percent_slider("Roundness", shape.roundness, ROUNDNESS_TIP, is_enabled=shape.kind == "polygon")
    rotation = slider("Rotation", shape.rotation_deg, (0.0, 359.0), "%.0f°", is_enabled=shape.kind in TURNED)
    return replace(edited, roundness=roundness, rotation_deg=rotation)


def light_section(state: AppState, scene: Scene) -> list[Action]:
    """Build the section: exposure and highlights."""
    stops, share = state.optics.exposure_stops, state.optics.highlight_recovery
    exposure = slider("Exposure", stops, (-EXPOSURE_LIMIT_STOPS, EXPOSURE_LIMIT_STOPS), "%+.1f stops")
    highlights = percent_slider("Highlights", share, HIGHLIGHT_TIP)
    return edit(lens.set_exposure, stops, exposure) + edit(lens.set_highlights, share, highlights)
