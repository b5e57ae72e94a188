"""What the optics mean for one picture: numbers for the passes, worked out before anything is drawn. No GL."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering import Optics
from iibr_core.scenes import WHOLE, Rect
from iibr_core.types import SRGB, ColorSpace, GridShape, ViewOffset
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.frame_budget import BEST_QUALITY, QualityLevel
from viewer.gpu.refocus.view_sampling import UNMOVED, ApertureSample, aperture_samples

FADE_FROM_PX, FADE_TO_PX = 4.0, 6.0
"""Over these widths of the whole blur, light moves from the sharp layer to those that are smoothed."""

LEAST_ACROSS = 2.0
"""Samples across the aperture, at least, however low the quality."""

SPARSE_UP_TO_PX = 1.2
"""As long as the whole blur of a tile is narrower, every other sample across and down shows the same."""

ONE_PASS_UP_TO_PX = 1.75
"""As long as neighbouring samples are no farther apart, nothing is seen between them."""

PASS_BLUR_PX = 1.5
"""Elsewhere so many passes are drawn that the samples of all are no farther apart than this."""

LEAST_PASSES = 4
"""And no fewer: those of two or three lie in lines."""

EVERY_PASS = 1e9
"""More than there are."""

HIGHLIGHT_SPREAD = 2.0
"""Samples of many passes lie unevenly: beside single bright pixels their gaps show, unless smoothing is wider."""


@dataclass(frozen=True)
class Lens:
    """What the optics mean for one picture. optics: as given; shaders take some of its numbers as they are.

    aperture_share: of the aperture sum in the picture, the rest is the pinhole pass. stride: view steps between
    samples. dolly: view steps (s, t) by which the ray crosses the grid elsewhere, per picture size. blur_px: output
    pixels that one px of disparity beside the focus moves from one sample to the next. widest_blur_px: the most that
    comes to in this field. samples_across: the whole blur in units of blur_px. keeps_layers: whether light is kept
    apart by defocus and smoothed. most_sources: stored views that a pinhole view is made of. part: what is drawn.
    color_space: of the field's light.
    """

    optics: Optics
    eye: ViewOffset
    diameter: float
    stride: int
    dolly: tuple[float, float]
    focus_range: float
    aperture_share: float
    blur_px: float
    widest_blur_px: float
    samples_across: float
    keeps_layers: bool
    highlight_gain: float
    exposure: float
    most_sources: int
    part: Rect = WHOLE
    color_space: ColorSpace = SRGB

    @property
    def sharp_up_to_px(self) -> tuple[float, float]:
        """Blur from one sample to the next at which the sharp layer begins to fade, and at which it is empty."""
        return min(1.0, FADE_FROM_PX / self.samples_across), min(2.0, FADE_TO_PX / self.samples_across)

    @property
    def sparse_up_to_px(self) -> float:
        """See SPARSE_UP_TO_PX, as blur from one sample to the next."""
        return SPARSE_UP_TO_PX / self.samples_across

    @property
    def smoothing_spread(self) -> float:
        """How wide smoothing is, as a share of what lies between samples of one pass."""
        return HIGHLIGHT_SPREAD if self.highlight_gain > 0 else 1.0

    @property
    def has_dolly(self) -> bool:
        """Whether rays of different pixels cross the grid at different places."""
        return self.dolly != (0.0, 0.0)

    def barrel(self, aspect: float) -> tuple[float, float, float]:
        """How far the barrel's opening moves across the picture (s, t), and its radius, view steps. aspect: H / W."""
        radius = self.diameter / 2
        across = 2 * self.optics.aperture_shape.cat_eye * radius / math.hypot(1.0, aspect)
        return across, across * aspect, radius

    def eye_at(self, u: float, v: float) -> ViewOffset:
        """Where the ray of the pixel at texture coordinates (u, v) crosses the grid."""
        return ViewOffset(self.eye.t + self.dolly[1] * (v - 0.5), self.eye.s + self.dolly[0] * (u - 0.5))

    def samples(
        self,
        grid: GridShape,
        present: NDArray[np.bool_],
        moved: ViewOffset = UNMOVED,
        coarser: int = 1,
        is_smoothed: bool = True,
    ) -> list[ApertureSample]:
        """Points of the lens and who answers; moved: the lattice; coarser: every how many of them.

        is_smoothed: whether these are to leave room for the smoothing, if there is any.
        """
        stride, leaves_room = self.stride * coarser, is_smoothed and self.keeps_layers
        return aperture_samples(
            self.eye, self.diameter, grid, present, self.optics.aperture_shape, stride, moved, leaves_room
        )


def passes_for(blur_px: float) -> int:
    """In how many passes a tile is drawn, by the blur from one sample to the next: see shaders/widen_tiles.frag."""
    return 1 if blur_px <= ONE_PASS_UP_TO_PX else max(math.ceil((blur_px / PASS_BLUR_PX) ** 2), LEAST_PASSES)


def pass_limits(finishes_tiles: bool) -> dict[str, float]:
    """The numbers of `passes_for`, as that shader names them; or such that every tile gets every pass."""
    if not finishes_tiles:
        return {"one_pass_up_to_px": -1.0, "pass_blur_px": PASS_BLUR_PX, "least_passes": EVERY_PASS}
    return {"one_pass_up_to_px": ONE_PASS_UP_TO_PX, "pass_blur_px": PASS_BLUR_PX, "least_passes": float(LEAST_PASSES)}


def lens_of(
    optics: Optics, field: LightFieldTexture, width_px: int, prefilter: bool, level: QualityLevel = BEST_QUALITY
) -> Lens:
    """The lens for a picture of that width."""
    diameter = max(optics.aperture_diameter, 0.0)
    stride = min(level.stride, max(int(diameter / LEAST_ACROSS), 1))
    step = max(min(diameter, float(stride)), 1e-6)
    blur_px = step * width_px / field.width if diameter > 0 else 0.0
    samples_across = max(min(diameter, float(max(field.grid))) / step, 1.0)
    # Layers pay where something is blurred: from one sample to the next, or in all by more than the sharp layer holds.
    beside = _most_beside_focus(optics, field.range_px)
    knows_depth = bool(field.has_disparity[field.present].all())
    keeps = prefilter and knows_depth and max(blur_px, blur_px * samples_across / FADE_FROM_PX) * beside > 1.0
    return Lens(
        optics=optics,
        eye=optics.eye,
        diameter=diameter,
        stride=stride,
        dolly=(-2.0 * optics.dolly, -2.0 * optics.dolly * field.height / field.width),
        focus_range=max(optics.focus_range, 0.0),
        aperture_share=aperture_share_of(diameter),
        blur_px=blur_px,
        widest_blur_px=blur_px * beside,
        samples_across=samples_across,
        keeps_layers=keeps,
        highlight_gain=optics.highlight_gain(diameter, field.hdr),
        exposure=2.0**optics.exposure_stops,
        most_sources=level.sources,
        color_space=field.color_space,
    )


def _most_beside_focus(optics: Optics, range_px: tuple[float, float]) -> float:
    tilt = sum(map(abs, optics.focus_tilt))
    farthest = max(abs(edge - optics.focus_disparity) for edge in range_px) + tilt
    return max(farthest - max(optics.focus_range, 0.0), 0.0)


def aperture_share_of(diameter: float) -> float:
    """How much of a picture is the sum over an aperture of so many view steps; the rest is the pinhole's."""
    return min(max(diameter - 1.0, 0.0), 1.0)
