"""Focus and aperture for a purpose, chosen for the scene."""

from __future__ import annotations

from dataclasses import replace
from math import isclose
from typing import TYPE_CHECKING, Literal

from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.scenes.lens_limits import aperture_of_disc, clamp_optics, focus_span
from iibr_core.scenes.scene import Scene

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


PresetName = Literal["portrait", "macro", "everything sharp"]
PRESETS: tuple[PresetName, ...] = ("portrait", "macro", "everything sharp")
PORTRAIT_DISC, MACRO_DISC = 0.05, 0.08
"""Disc of the farthest background with the nearest in focus, as a share of the picture's width."""
PORTRAIT_RANGE = 0.1
"""Sharp depth before and behind a portrait's focus, as a share of all disparity: a head and its shoulders."""


def preset_optics(name: PresetName, optics: Optics, scene: Scene, subject: float) -> Optics:
    """Return the optics for a purpose; viewpoint, dolly, exposure and highlights stay.

    subject: disparity of a portrait's subject.
    """
    plain = replace(optics, focus_range=0.0, focus_tilt=(0.0, 0.0))
    if name == "everything sharp":
        return replace(plain, aperture_diameter=0.0)
    aperture = aperture_of_disc(scene, MACRO_DISC if name == "macro" else PORTRAIT_DISC)
    plain = replace(plain, aperture_diameter=aperture, aperture_shape=ApertureShape())
    if name == "macro":
        return replace(plain, focus_disparity=scene.disparity_range_px[1])
    focused = replace(plain, focus_disparity=subject, focus_range=PORTRAIT_RANGE * focus_span(scene))
    return clamp_optics(focused, scene)


def subject_disparity(state: AppState, scene: Scene) -> float:
    """Return the disparity that the user made sharp last, else that of the likely subject."""
    return scene.subject_disparity_px if state.chosen_focus is None else state.chosen_focus


def active_preset(state: AppState, scene: Scene) -> PresetName | None:
    """Return the preset that the lens is set to, None if it is set otherwise."""
    optics, subject = state.optics, subject_disparity(state, scene)
    presets = {name: preset_optics(name, optics, scene, subject) for name in PRESETS}
    return next((name for name, preset in presets.items() if _is_alike(preset, optics)), None)


def _is_alike(one: Optics, other: Optics) -> bool:
    """Return whether optics are equal but for the rounding that other plans of the scene bring."""
    numbers = [(each.aperture_diameter, each.focus_disparity, each.focus_range) for each in (one, other)]
    aperture, focus, focus_range = numbers[0]
    same = replace(other, aperture_diameter=aperture, focus_disparity=focus, focus_range=focus_range)
    return same == one and all(isclose(a, b, rel_tol=1e-6, abs_tol=1e-6) for a, b in zip(*numbers))
