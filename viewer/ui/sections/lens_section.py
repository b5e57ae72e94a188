"""The sliders of focus and aperture, and the panel's sections for focus, aperture and light."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from imgui_bundle import imgui

from iibr_core.beyond.optics import (
    APERTURE_KINDS,
    EXPOSURE_LIMIT_STOPS,
    RING_INNER_LIMIT,
    ApertureKind,
    ApertureShape,
)
from iibr_core.scenes.lens_limits import BLADES_LIMITS, aperture_limit, focus_limits, focus_span
from iibr_core.scenes.scene import Scene
from viewer.model import lens
from viewer.model.action import Action, ask, do
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.tasks import ChooseTask
from viewer.model.units import (
    ASSUMED_DISTANCE_M,
    disparity_at,
    disparity_at_percent,
    distance_limits,
    f_number,
    f_number_text,
    far_percent,
    metres,
    metres_text,
    relative_distance,
)
from viewer.ui.sections.aperture_icons import draw_shape
from viewer.ui.style import Palette, palette_of
from viewer.ui.widgets import button, checkbox, choice, end_words, percent_slider, quiet, slider, whole_slider

FOCUS_TIP = "Distance that is sharp, from near to far. You can also click in the picture or turn the wheel."
FOCUS_DISPARITY_TIP = "Disparity that is sharp, in pixels per view step. Larger is closer."
DISTANCE_TIP = "Distance that is sharp. 1 is the plane that stays still while the viewpoint moves."
RANGE_TIP = "Depth before and behind the focus that is also sharp."
APERTURE_TIP = "Opening of the lens. A wider opening blurs everything out of focus more."
F_NUMBER_TIP = " The f-number is that of a full-frame lens that is focused at {:.0f} m."
EQUIVALENT_TIP = " ≈ f/2 means: an 85 mm full-frame lens, focused at 2 m, blurs the background as much at f/2."
ALL_SHARP = "all sharp"
"""F-number of a pinhole."""

CLOSED_STOPS = 6.0
"""Length of the aperture's slider in stops, from the widest to a pinhole."""
TILT_TIP = "Shows two handles in the picture. Drag them onto two objects to make both sharp, and all between."
HIGHLIGHT_TIP = "Glow of bright spots, such as lamps, that are out of focus."
KIND_TIPS: dict[ApertureKind, str] = {
    "disc": "Disc",
    "polygon": "Blades",
    "ring": "Ring, like a mirror lens",
    "cat_eye": "Cat's eye: cut off toward the picture's corners",
    "mask": "Your own grey image",
}


def focus_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section: the focus as a distance if it is known, range, tilt."""
    optics = state.optics
    actions = _distance(state, scene, layout) if state.preferences.units == "light field" else []
    span, unit = focus_span(scene), _unit_of_focus(state, scene)
    form = f"± {unit.form}" if optics.focus_range else "none"
    new = slider("Range", optics.focus_range / unit.size, (0.0, span / unit.size), form, layout, RANGE_TIP)
    actions += [] if new is None else [do(lens.set_focus_range, new * unit.size)]
    shown = checkbox("Tilt", state.tilt_handles is not None or any(optics.focus_tilt), layout, TILT_TIP)
    if shown is not None:
        actions += [do(lens.show_tilt_handles, shown)] + ([] if shown else [do(lens.set_focus_tilt, (0.0, 0.0))])
    is_tilted = state.tilt_handles is not None or any(optics.focus_tilt)
    right, down = optics.focus_tilt
    limits = (-span / unit.size, span / unit.size)
    form = unit.form.replace("%", "%+", 1)
    new = slider("Tilt right", right / unit.size, limits, form, layout, is_enabled=is_tilted)
    actions += [] if new is None else [do(lens.set_focus_tilt, (new * unit.size, down))]
    new = slider("Tilt down", down / unit.size, limits, form, layout, is_enabled=is_tilted)
    actions += [] if new is None else [do(lens.set_focus_tilt, (right, new * unit.size))]
    return actions


@dataclass(frozen=True)
class _Unit:
    """A unit of disparity differences. size: in px per view step. form: printf-like."""

    size: float
    form: str


def _unit_of_focus(state: AppState, scene: Scene) -> _Unit:
    """Return the unit of differences: a hundredth of the range from near to far, or disparity."""
    if state.preferences.units == "light field":
        return _Unit(1.0, "%.2f px")
    return _Unit(focus_span(scene) / 100, "%.0f %%")


def focus_slider(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the focus slider: from near to far, in metres if they are known; or as disparity."""
    actions: list[Action] = []
    disparity = state.optics.focus_disparity
    if state.preferences.units == "light field" or not scene.has_view_disparity:  # else nothing is near or far yet
        new = slider("Focus", disparity, focus_limits(scene), "%.2f px", layout, FOCUS_DISPARITY_TIP)
        actions += [] if new is None else [do(lens.set_focus, new)]
        return actions
    distance = metres(scene, disparity)
    form = "%.0f %%" if distance is None else metres_text(distance)
    new = slider("Focus", far_percent(scene, disparity), (0.0, 100.0), form, layout, FOCUS_TIP)
    end_words("near", "far", layout)
    actions += [] if new is None else [do(lens.set_focus, disparity_at_percent(scene, new))]
    return actions


def _distance(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the slider of the focus as a distance, if that is known."""
    limits = distance_limits(scene)
    distance = relative_distance(scene, state.optics.focus_disparity)
    if limits is None:
        return []
    shown = min(max(distance if distance is not None else limits[1], limits[0]), limits[1])
    new = slider("Distance", shown, limits, "× %.2f", layout, DISTANCE_TIP, is_logarithmic=True)
    disparity = None if new is None else disparity_at(scene, new)
    return [] if disparity is None else [do(lens.set_focus, disparity)]


def aperture_slider(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the aperture slider."""
    diameter, widest = state.optics.aperture_diameter, aperture_limit(scene.grid)
    words, is_exact = f_number_text(scene, diameter), f_number(scene, widest) is not None
    tip = APERTURE_TIP + (F_NUMBER_TIP.format(ASSUMED_DISTANCE_M) if is_exact else EQUIVALENT_TIP)
    if state.preferences.units == "light field":
        form = ALL_SHARP if diameter == 0 else f"%.1f views  ·  {words}"
        new = slider("Aperture", diameter, (0.0, widest), form, layout, tip)
        return [] if new is None else [do(lens.set_aperture, new)]
    return _stops(diameter, widest, ALL_SHARP if diameter == 0 else words, layout, tip)


def aperture_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section: the opening's shape and its numbers."""
    shape = state.optics.aperture_shape
    actions = _kinds(shape, layout, palette_of(state.preferences.theme))
    if shape.kind == "mask":
        actions += _mask_row(shape, layout)
    return actions + [do(lens.set_aperture_shape, new) for new in _shape_edits(shape, layout)]


def _stops(diameter: float, widest: float, words: str, layout: Layout, tip: str) -> list[Action]:
    """Build the aperture slider in stops, like the ring of a lens: a pinhole at the left, wide open at the right."""
    closed = CLOSED_STOPS if diameter == 0 else min(math.log2(widest / diameter), CLOSED_STOPS)
    stops = slider("Aperture", CLOSED_STOPS - closed, (0.0, CLOSED_STOPS), words, layout, tip)
    if stops is None:
        return []
    return [do(lens.set_aperture, widest * 2.0 ** (stops - CLOSED_STOPS) if stops > 0 else 0.0)]


def _kinds(shape: ApertureShape, layout: Layout, palette: Palette) -> list[Action]:
    """Build a row of buttons that show the shapes. The mask without an image opens a dialog."""
    actions: list[Action] = []
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - spacing * (len(APERTURE_KINDS) - 1)) / len(APERTURE_KINDS)
    height = 32 * layout.ui_scale
    for kind in APERTURE_KINDS:
        corner = imgui.get_cursor_screen_pos()
        if choice(f"##{kind}", shape.kind == kind, layout, (width, height), KIND_TIPS[kind]):
            needs_image = kind == "mask" and shape.mask is None
            actions.append(
                do(ask, ChooseTask("mask")) if needs_image else do(lens.set_aperture_shape, replace(shape, kind=kind))
            )
        middle = corner.x + width / 2, corner.y + height / 2
        draw_shape(replace(shape, kind=kind), middle, 0.32 * height, palette)
        imgui.same_line()
    imgui.new_line()
    return actions


def _shape_edits(shape: ApertureShape, layout: Layout) -> list[ApertureShape]:
    """Build two rows for every shape, so that nothing below moves under a click."""
    edits: list[ApertureShape | None] = []
    if shape.kind in ("disc", "polygon"):
        blades = whole_slider("Blades", shape.blades, BLADES_LIMITS, layout, is_enabled=shape.kind == "polygon")
        edits.append(None if blades is None else replace(shape, blades=blades))
    if shape.kind == "ring":
        inner = slider("Blocked", shape.ring_inner, (0.0, RING_INNER_LIMIT), "%.2f of the radius", layout)
        edits.append(None if inner is None else replace(shape, ring_inner=inner))
    if shape.kind == "cat_eye":
        cut = slider("Cut off", shape.cat_eye, (0.0, 1.0), "%.2f", layout)
        edits.append(None if cut is None else replace(shape, cat_eye=cut))
    can_turn = shape.kind in ("polygon", "mask")
    turned = slider("Rotation", shape.rotation_deg, (0.0, 359.0), "%.0f°", layout, is_enabled=can_turn)
    edits.append(None if turned is None else replace(shape, rotation_deg=turned))
    return [edit for edit in edits if edit is not None]


def _mask_row(shape: ApertureShape, layout: Layout) -> list[Action]:
    actions: list[Action] = []
    if button("Image…", layout, "Choose a small grey image. White lets light through."):
        actions.append(do(ask, ChooseTask("mask")))
    if shape.mask is not None:
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        quiet(shape.mask.name)
    return actions


def light_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section: exposure and highlights."""
    optics = state.optics
    actions: list[Action] = []
    limits = (-EXPOSURE_LIMIT_STOPS, EXPOSURE_LIMIT_STOPS)
    new = slider("Exposure", optics.exposure_stops, limits, "%+.1f stops", layout)
    actions += [] if new is None else [do(lens.set_exposure, new)]
    new = percent_slider("Highlights", optics.highlight_recovery, layout, HIGHLIGHT_TIP)
    actions += [] if new is None else [do(lens.set_highlights, new)]
    return actions
