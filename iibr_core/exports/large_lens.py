"""The lens of the screen's picture for a picture at the photo's own size. No GL."""

from __future__ import annotations

import math

import numpy as np

from iibr_core.rendering.aperture_shape import openness
from iibr_core.rendering.lens_light import LargeLens, LensSample
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewOffset

SHARP_UP_TO_PX = (1.0, 2.0)
"""Pixels of the light field: what is blurred wider holds nothing that its own picture does not show."""
SPACING_PX = 1.2
"""Neighbouring points of the lens see what counts as sharp no farther apart than this."""


def large_lens(optics: Optics, scene: Scene, enlarged: float) -> LargeLens:
    """For a picture so many times as wide as a view of the scene. Its dolly is left out."""
    diameter = max(optics.aperture_diameter, 0.0)
    from_px, to_px = (enlarged * px for px in SHARP_UP_TO_PX)
    far, near = (abs(edge - optics.focus_disparity) for edge in scene.disparity_range_px)
    widest_px = diameter * enlarged * (max(far, near) + sum(map(abs, optics.focus_tilt)))
    across = max(math.ceil(min(to_px, widest_px) / SPACING_PX), 1)
    return LargeLens(
        eye=optics.eye,
        samples=_samples(optics, diameter, across, float(max(scene.grid))) if diameter > 1 else (),
        share=min(max(diameter - 1.0, 0.0), 1.0),
        diameter=min(diameter, float(max(scene.grid))),
        focus=enlarged * optics.focus_disparity,
        tilt=(enlarged * optics.focus_tilt[0], enlarged * optics.focus_tilt[1]),
        focus_range=enlarged * max(optics.focus_range, 0.0),
        sharp_up_to_px=(from_px, to_px),
        highlight_gain=optics.highlight_gain(diameter, scene.is_hdr),
        exposure=2.0**optics.exposure_stops,
    )


def _samples(optics: Optics, diameter: float, across: int, widest: float) -> tuple[LensSample, ...]:
    """A lattice of so many points across and down, weighted by what the aperture leaves of their squares."""
    step = min(diameter, widest) / across
    places = step * (np.arange(across) - (across - 1) / 2)
    t, s = np.meshgrid(places, places, indexing="ij")
    weights = openness(optics.aperture_shape, t, s, diameter, widest, step)
    if weights.sum() <= 0:  # a mask's hole
        weights = np.ones_like(weights)
    chosen = weights > 0
    weights = weights / weights.sum()
    return tuple(
        LensSample(ViewOffset(*at), weight)
        for *at, weight in zip(t[chosen].tolist(), s[chosen].tolist(), weights[chosen].tolist())
    )
