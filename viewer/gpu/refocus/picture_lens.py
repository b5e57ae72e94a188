"""Numbers of one picture that follow from the optics, computed before anything is drawn. No GL."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.lens_slices import Slice, slices_of
from iibr_core.beyond.optics import Optics
from iibr_core.beyond.picture_quality import BEST_QUALITY, EDGE_PASSES, QualityLevel
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, ViewOffset
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus import view_sampling
from viewer.gpu.refocus.view_sampling import Samples

BARREL_EDGE = 1 / 16
"""Width of the edge of a cat's-eye, as a share of the aperture's diameter."""
TILT_STEPS = 17
"""Number of places across the picture at which a tilted focus is looked at."""
MARGIN_STEP_PX = 4
"""Pixels of which the margin is a multiple: software GL draws squares of so many pixels."""
EDGE_MARGIN_PX = 4
"""Pixels around the discs that edges and reductions need."""


@dataclass(frozen=True)
class Lens:
    """The lens of one picture.

    diameter: of the aperture, view steps, 0 for a pinhole. slices: of the picture through an open lens, from near to
    far; none for a pinhole, and for views without disparity, which are added up instead. dolly: change of the place
    (s, t) where rays cross the grid, view steps per picture size. disc_px: diameter of a disc in output pixels, for
    1 px per view step out of focus. texel_px: size of a pixel of the views in output pixels. level: limits of quality.
    part: drawn part of the picture. field_part: part of the picture that the field's views show. color_space: of the
    field's light. hidden_scale: factor from the disparity of the hidden surface to that of the views. behind_eye:
    (s, t) of the eye from the viewpoint of the hidden surface, in its view steps.
    """

    optics: Optics
    diameter: float
    slices: tuple[Slice, ...]
    dolly: tuple[float, float]
    disc_px: float
    texel_px: float
    highlight_gain: float
    level: QualityLevel
    part: Rect = WHOLE
    field_part: Rect = WHOLE
    color_space: ColorSpace = SRGB
    hidden_scale: float = 1.0
    behind_eye: tuple[float, float] = (0.0, 0.0)

    @property
    def eye(self) -> ViewOffset:
        """Viewpoint in view steps."""
        return self.optics.eye

    @property
    def has_dolly(self) -> bool:
        """Whether rays of different pixels cross the grid at different places."""
        return self.dolly != (0.0, 0.0)

    @property
    def margin_px(self) -> int:
        """Width of the border around the picture whose light the discs spread into it, in output pixels."""
        if not self.slices:
            return 0
        reach_px = max(each.reach_px for each in self.slices) + EDGE_MARGIN_PX
        return MARGIN_STEP_PX * math.ceil(reach_px / MARGIN_STEP_PX)

    def barrel(self, aspect: float) -> tuple[float, float, float]:
        """Return the motion of the barrel's opening across the picture (s, t) and its radius, in radii of the opening.

        aspect: height / width.
        """
        across = 2 * self.optics.aperture_shape.cat_eye / math.hypot(1.0, aspect)
        return across, across * aspect, 1.0

    def pinhole(self, size_px: ScreenSize) -> Lens:
        """Return the pinhole whose picture, with a margin, becomes this lens' picture of a size."""
        return replace(self, diameter=0.0, slices=(), part=grown(self.part, self.margin_px, size_px))

    def pass_count(self, field: LightFieldTexture) -> int:
        """Return the number of passes until all edges are smooth."""
        is_moved = self.has_dolly or not is_stored(self.eye, field)
        is_warped = bool(field.has_disparity.any()) or self.has_dolly
        return EDGE_PASSES if is_warped and is_moved and self.level == BEST_QUALITY else 1

    def samples(self, field: LightFieldTexture) -> Samples:
        """Return the cameras of a pass and the views that answer them. field: has views."""
        grid, present = field.grid, field.present
        if self.has_dolly and self.diameter == 0:
            return view_sampling.every_corner()
        if self.diameter == 0:
            sources = view_sampling.pinhole_sources(self.eye, grid, present)
            return view_sampling.pinhole_samples(sources[: self.level.sources])
        return view_sampling.blended_samples(self.optics.aperture_shape, self.diameter, self.eye, grid, present)

    def sample_count(self, field: LightFieldTexture) -> int:
        """Return the number of samples of a pass."""
        lens = replace(self, diameter=0.0) if self.slices else self
        return len(lens.samples(field)) if field.present.any() else 0


def lens_of(optics: Optics, field: LightFieldTexture, width_px: int, level: QualityLevel = BEST_QUALITY) -> Lens:
    """Return the lens of a picture of that width."""
    diameter = max(optics.aperture_diameter, 0.0)
    texel_px = width_px / field.width
    disc_px = diameter * texel_px
    widest = float(np.abs(_defocus_px(optics, field, disc_px)).max())
    # Wider discs than the picture would only take memory.
    disc_px *= min(1.0, width_px / max(widest, 1e-9))
    is_open = disc_px > 0 and bool(field.has_disparity.any())
    return Lens(
        optics=optics,
        diameter=diameter,
        slices=slices_of(_defocus_px(optics, field, disc_px), optics.aperture_shape) if is_open else (),
        dolly=dolly_of(optics, field),
        disc_px=disc_px,
        texel_px=texel_px,
        highlight_gain=optics.highlight_gain(diameter, field.hdr),
        level=level,
        color_space=field.color_space,
        behind_eye=(optics.eye.s, field.row_step * optics.eye.t),
    )


def grown(part: Rect, margin_px: int, size_px: ScreenSize) -> Rect:
    """Return a part of a picture with a margin, in pixels of its target."""
    across, down = margin_px * part.width / size_px.width, margin_px * part.height / size_px.height
    return Rect(part.x - across, part.y - down, part.width + 2 * across, part.height + 2 * down)


def dolly_of(optics: Optics, field: LightFieldTexture) -> tuple[float, float]:
    """Return the change of the place (s, t) where rays cross the grid, in view steps per picture size."""
    across = -2.0 * optics.dolly
    return across, across * field.height / field.width / field.row_step


def is_stored(eye: ViewOffset, field: LightFieldTexture) -> bool:
    """Return whether a present view lies at this viewpoint."""
    row, column = float(eye.t + field.grid.centre[0]), float(eye.s + field.grid.centre[1])
    is_on_grid = 0 <= row < field.grid.rows and 0 <= column < field.grid.columns
    return is_on_grid and row.is_integer() and column.is_integer() and bool(field.present[int(row), int(column)])


def _defocus_px(optics: Optics, field: LightFieldTexture, disc_px: float) -> NDArray[np.float64]:
    """Return the diameters of discs that occur in a picture, negative behind the focus."""
    tilt = sum(map(abs, optics.focus_tilt))
    focus = optics.focus_disparity + np.linspace(-tilt, tilt, TILT_STEPS if tilt else 1)
    beside = field.disparity_sample[:, None].astype(np.float64) - focus
    return disc_px * np.sign(beside) * np.maximum(np.abs(beside) - max(optics.focus_range, 0.0), 0.0)
