"""The panel's sections for focus, aperture and light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

from imgui_bundle import imgui

from viewer.model.actions import Action, DoTask, ShowTiltHandles
from viewer.model.layout import Layout
from viewer.model.lens.limits import BLADES_LIMITS, aperture_limit, focus_limits, focus_span
from viewer.model.lens.photographic_units import (
    ASSUMED_DISTANCE_M,
    disparity_at,
    distance_limits,
    f_number,
    relative_distance,
)
from viewer.model.state.app_state import AppState, ChooseTask, Scene
from viewer.model.state.optics import (
    APERTURE_KINDS,
    EXPOSURE_LIMIT_STOPS,
    RING_INNER_LIMIT,
    ApertureKind,
    ApertureShape,
    SetAperture,
    SetApertureShape,
    SetExposure,
    SetFocus,
    SetFocusRange,
    SetHighlightRecovery,
    SetTilt,
)
from viewer.ui.sections.aperture_icons import draw_shape
from viewer.ui.style import Palette
from viewer.ui.widgets import button, checkbox, choice, quiet, slider, whole_slider

FOCUS_TIP = "Disparity that is sharp, px per view step: larger is closer. Click in the picture, or turn the wheel."
DISTANCE_TIP = "Distance that is sharp; 1 is the plane that stays still when the viewpoint moves."
RANGE_TIP = "Everything within this much disparity around the focus is sharp."
TILT_TIP = "Shows two handles over the picture: drag them onto two things, and the plane of focus runs through both."
HIGHLIGHT_TIP = "Lets clipped highlights count for more, so that they bloom where they are out of focus."
KIND_TIPS: dict[ApertureKind, str] = {
    "disc": "Disc",
    "polygon": "Blades",
    "ring": "Ring, as of a mirror lens",
    "cat_eye": "Cat's eye: cut off toward the corners",
    "mask": "A grey image of your own",
}


def focus_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section: focus in disparity and distance, range, tilt."""
    optics = state.optics
    actions: list[Action] = []
    _add(actions, SetFocus, slider("Focus", optics.focus_disparity, focus_limits(scene), "%.2f px", layout, FOCUS_TIP))
    actions += _distance(state, scene, layout)
    span = focus_span(scene)
    form = "± %.2f px" if optics.focus_range else "none"
    _add(actions, SetFocusRange, slider("Range", optics.focus_range, (0.0, span), form, layout, RANGE_TIP))
    shown = checkbox("Tilt", state.tilt_handles is not None or any(optics.focus_tilt), layout, TILT_TIP)
    if shown is not None:
        actions += [ShowTiltHandles(shown)] if shown else [ShowTiltHandles(False), SetTilt((0.0, 0.0))]
    if state.tilt_handles is not None or any(optics.focus_tilt):
        right, down = optics.focus_tilt
        new = slider("to the right", right, (-span, span), "%+.2f px", layout)
        _add(actions, lambda value: SetTilt((value, down)), new)
        new = slider("downward", down, (-span, span), "%+.2f px", layout)
        _add(actions, lambda value: SetTilt((right, value)), new)
    return actions


def _distance(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """The focus as a distance, where that is known."""
    limits = distance_limits(scene)
    distance = relative_distance(scene, state.optics.focus_disparity)
    if limits is None:
        return []
    shown = min(max(distance if distance is not None else limits[1], limits[0]), limits[1])
    new = slider("Distance", shown, limits, "× %.2f", layout, DISTANCE_TIP, is_logarithmic=True)
    disparity = None if new is None else disparity_at(scene, new)
    return [] if disparity is None else [SetFocus(disparity)]


def aperture_section(state: AppState, scene: Scene, layout: Layout, palette: Palette) -> list[Action]:
    """Build the section: diameter, shape, and what the shape asks for."""
    actions: list[Action] = []
    diameter = state.optics.aperture_diameter
    stop = f_number(scene, diameter)
    form = "pinhole" if diameter == 0 else "%.1f views" + (f"  ·  f/{stop:.1f}" if stop else "")
    tip = "How wide the lens is open: wider blurs more of what is out of focus."
    if scene.focal_px:
        tip += f" The f-number is that of a full-frame lens focused at {ASSUMED_DISTANCE_M:.0f} m."
    limits = (0.0, aperture_limit(scene.grid))
    _add(actions, SetAperture, slider("Diameter", diameter, limits, form, layout, tip))
    shape = state.optics.aperture_shape
    actions += _kinds(shape, layout, palette)
    actions += [SetApertureShape(new) for new in _shape_edits(shape, layout)]
    if shape.kind == "mask":
        actions += _mask_row(shape, layout)
    return actions


def _kinds(shape: ApertureShape, layout: Layout, palette: Palette) -> list[Action]:
    """A row of buttons that show the shapes. Choosing the mask without one asks for an image."""
    actions: list[Action] = []
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - spacing * (len(APERTURE_KINDS) - 1)) / len(APERTURE_KINDS)
    height = 32 * layout.ui_scale
    for kind in APERTURE_KINDS:
        corner = imgui.get_cursor_screen_pos()
        if choice(f"##{kind}", shape.kind == kind, layout, (width, height), KIND_TIPS[kind]):
            needs_image = kind == "mask" and shape.mask is None
            actions.append(DoTask(ChooseTask("mask")) if needs_image else SetApertureShape(replace(shape, kind=kind)))
        middle = corner.x + width / 2, corner.y + height / 2
        draw_shape(replace(shape, kind=kind), middle, 0.32 * height, palette)
        imgui.same_line()
    imgui.new_line()
    return actions


def _shape_edits(shape: ApertureShape, layout: Layout) -> list[ApertureShape]:
    edits: list[ApertureShape | None] = []
    if shape.kind == "polygon":
        blades = whole_slider("Blades", shape.blades, BLADES_LIMITS, layout)
        edits.append(None if blades is None else replace(shape, blades=blades))
    if shape.kind in ("polygon", "mask"):
        turned = slider("Rotation", shape.rotation_deg, (0.0, 359.0), "%.0f°", layout)
        edits.append(None if turned is None else replace(shape, rotation_deg=turned))
    if shape.kind == "ring":
        inner = slider("Blocked", shape.ring_inner, (0.0, RING_INNER_LIMIT), "%.2f of the radius", layout)
        edits.append(None if inner is None else replace(shape, ring_inner=inner))
    if shape.kind == "cat_eye":
        cut = slider("Cut off", shape.cat_eye, (0.0, 1.0), "%.2f", layout)
        edits.append(None if cut is None else replace(shape, cat_eye=cut))
    return [edit for edit in edits if edit is not None]


def _mask_row(shape: ApertureShape, layout: Layout) -> list[Action]:
    actions: list[Action] = []
    if button("Image…", layout, "Choose a small grey image; white lets light through."):
        actions.append(DoTask(ChooseTask("mask")))
    if shape.mask is not None:
        imgui.same_line()
        imgui.align_text_to_frame_padding()
        quiet(shape.mask.name)
    return actions


def light_section(state: AppState, layout: Layout) -> list[Action]:
    """Build the section: exposure and highlights."""
    optics = state.optics
    actions: list[Action] = []
    limits = (-EXPOSURE_LIMIT_STOPS, EXPOSURE_LIMIT_STOPS)
    _add(actions, SetExposure, slider("Exposure", optics.exposure_stops, limits, "%+.1f stops", layout))
    new = slider("Highlights", 100 * optics.highlight_recovery, (0.0, 100.0), "%.0f %%", layout, HIGHLIGHT_TIP)
    _add(actions, lambda percent: SetHighlightRecovery(percent / 100), new)
    return actions


def _add(actions: list[Action], action: Callable[[float], object], value: float | None) -> None:
    if value is not None:
        actions.append(cast(Action, action(value)))
