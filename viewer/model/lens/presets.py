"""Focus and aperture for a purpose, from what is known of the scene."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.scenes.lens_limits import aperture_limit, focus_span
from iibr_core.scenes.scene import Scene
from viewer.model.state.optics_actions import PresetName

PRESETS: tuple[PresetName, ...] = ("portrait", "macro", "everything sharp")

PORTRAIT_APERTURE = 0.6
PORTRAIT_RANGE = 0.06
"""Of all the disparity there is: a face is sharp from nose to ear."""


def preset_optics(name: PresetName, optics: Optics, scene: Scene, has_chosen_focus: bool) -> Optics:
    """The optics for this purpose; viewpoint, dolly, exposure and highlights stay as they are.

    has_chosen_focus: whether the user said what is sharp; then it is the portrait's subject.
    """
    plain = replace(optics, focus_range=0.0, focus_tilt=(0.0, 0.0))
    widest = aperture_limit(scene.grid)
    match name:
        case "portrait":
            return replace(
                plain,
                focus_disparity=optics.focus_disparity if has_chosen_focus else scene.subject_disparity_px,
                focus_range=PORTRAIT_RANGE * focus_span(scene),
                aperture_diameter=PORTRAIT_APERTURE * widest,
                aperture_shape=ApertureShape(),
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
