"""Focus and aperture for a purpose, from what is known of the scene."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.lens.limits import aperture_limit, focus_span
from viewer.model.state.app_state import Scene
from viewer.model.state.optics import ApertureShape, Optics, PresetName

PRESETS: tuple[PresetName, ...] = ("portrait", "macro", "everything sharp")

PORTRAIT_APERTURE = 0.6
PORTRAIT_RANGE = 0.06
"""Of all the disparity there is: a face is sharp from nose to ear."""


def preset_optics(name: PresetName, optics: Optics, scene: Scene) -> Optics:
    """The optics for this purpose; viewpoint, dolly and exposure stay as they are."""
    plain = replace(optics, focus_range=0.0, focus_tilt=(0.0, 0.0), highlight_recovery=0.0)
    widest = aperture_limit(scene.grid)
    match name:
        case "portrait":
            return replace(
                plain,
                focus_disparity=scene.subject_disparity_px,
                focus_range=PORTRAIT_RANGE * focus_span(scene),
                aperture_diameter=PORTRAIT_APERTURE * widest,
                aperture_shape=ApertureShape(),
                highlight_recovery=0.4,
            )
        case "macro":
            return replace(
                plain,
                focus_disparity=scene.disparity_range_px[1],
                aperture_diameter=widest,
                aperture_shape=ApertureShape(),
            )
        case "everything sharp":
            return replace(plain, aperture_diameter=0.0)
