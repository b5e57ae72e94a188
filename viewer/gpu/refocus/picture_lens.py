"""Numbers of one picture that follow from the optics, computed before anything is drawn. No GL."""

from __future__ import annotations

import math
from dataclasses import dataclass

from iibr_core.beyond.aperture_sampling import aperture_points, open_area
from iibr_core.beyond.optics import Optics
from iibr_core.beyond.picture_quality import (
    BEST_QUALITY,
    BLEND_POINTS,
    CAMERAS_PER_PX,
    EDGE_PASSES,
    FIRST_SPACING_PX,
    MAX_CAMERAS,
    MAX_PASS,
    MIN_CAMERAS,
    MIN_PASS,
    QualityLevel,
)
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.types import SRGB, ColorSpace, ViewOffset
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus import view_sampling
from viewer.gpu.refocus.view_sampling import Samples

BARREL_EDGE = 1 / 16
"""Width of the edge of a cat's-eye, as a share of the aperture's diameter."""


@dataclass(frozen=True)
class Lens:
    """The lens of one picture.

    diameter: of the aperture, view steps, 0 for a pinhole. widest: side of the square of views, which cuts it off.
    dolly: change of the place (s, t) where rays cross the grid, view steps per picture size. blur_px: width of the
    widest blur in this field, output pixels. level: limits of quality. part: drawn part of the picture. field_part:
    part of the picture that the field's views show. color_space: of the field's light.
    """

    optics: Optics
    diameter: float
    widest: float
    dolly: tuple[float, float]
    blur_px: float
    highlight_gain: float
    level: QualityLevel
    part: Rect = WHOLE
    field_part: Rect = WHOLE
    color_space: ColorSpace = SRGB

    @property
    def eye(self) -> ViewOffset:
        """Viewpoint in view steps."""
        return self.optics.eye

    @property
    def has_dolly(self) -> bool:
        """Whether rays of different pixels cross the grid at different places."""
        return self.dolly != (0.0, 0.0)

    def barrel(self, aspect: float) -> tuple[float, float, float]:
        """Return the motion of the barrel's opening across the picture (s, t) and its radius, view steps.

        aspect: height / width.
        """
        radius = self.diameter / 2
        across = 2 * self.optics.aperture_shape.cat_eye * radius / math.hypot(1.0, aspect)
        return across, across * aspect, radius

    @property
    def cameras_per_pass(self) -> int:
        """Number of cameras of a pass through an aperture, at this quality."""
        best = min(max(math.ceil(self.blur_px / FIRST_SPACING_PX), MIN_PASS), MAX_PASS)
        return max(round(best * self.level.cameras), 1)

    @property
    def passes_through_aperture(self) -> int:
        """Number of passes until the most blurred surface is smooth."""
        if self.level != BEST_QUALITY:
            return 1
        cameras = min(max(CAMERAS_PER_PX * self.blur_px, MIN_CAMERAS), MAX_CAMERAS)
        return math.ceil(cameras / self.cameras_per_pass)

    def pass_count(self, field: LightFieldTexture) -> int:
        """Return the number of passes until the most blurred surface and all edges are smooth."""
        is_warped = bool(field.has_disparity.any())
        if not (is_warped or self.has_dolly):
            return 1
        if self.diameter > 0:
            return self.passes_through_aperture
        is_moved = self.has_dolly or not is_stored(self.eye, field)
        return EDGE_PASSES if self.level == BEST_QUALITY and is_moved else 1

    def samples(self, field: LightFieldTexture, pass_index: int) -> Samples:
        """Return the cameras of a pass and the views that answer them. field: has views."""
        grid, present = field.grid, field.present
        if self.diameter == 0 and self.has_dolly:
            return view_sampling.every_corner()
        if self.diameter == 0:
            sources = view_sampling.pinhole_sources(self.eye, grid, present)
            return view_sampling.pinhole_samples(sources[: self.level.sources])
        is_blend = not (field.has_disparity.any() or self.has_dolly)
        count = BLEND_POINTS if is_blend else self.cameras_per_pass
        cell = 0.0 if is_blend else self.cell(pass_index)
        points = aperture_points(self.optics.aperture_shape, self.diameter, self.widest, count, pass_index, cell)
        if is_blend:
            return view_sampling.blended_samples(points, self.eye, grid, present)
        return view_sampling.answered_samples(points, pass_index * count, self.eye, grid, present)

    def cell(self, pass_index: int) -> float:
        """Return the side, in view steps, of the square of the aperture around each camera of a pass.

        The first pass, which is shown alone, fills the aperture by itself; the other cameras share it with all.
        """
        if self.diameter == 0:
            return 0.0
        passes = self.passes_through_aperture if pass_index > 0 else 1
        area = open_area(self.optics.aperture_shape, self.diameter, self.widest)
        return math.sqrt(area / (self.cameras_per_pass * passes))

    def sample_count(self, field: LightFieldTexture) -> int:
        """Return the number of samples of a pass."""
        return len(self.samples(field, 0)) if field.present.any() else 0


def lens_of(
    optics: Optics,
    field: LightFieldTexture,
    width_px: int,
    level: QualityLevel = BEST_QUALITY,
    widest: float | None = None,
) -> Lens:
    """Return the lens of a picture of that width. widest: see `Lens`; None for the side of the grid."""
    diameter = max(optics.aperture_diameter, 0.0)
    widest = float(max(field.grid)) if widest is None else widest
    return Lens(
        optics=optics,
        diameter=diameter,
        widest=widest,
        dolly=dolly_of(optics, field),
        blur_px=min(diameter, widest) * _max_defocus(optics, field.range_px) * width_px / field.width,
        highlight_gain=optics.highlight_gain(diameter, field.hdr),
        level=level,
        color_space=field.color_space,
    )


def dolly_of(optics: Optics, field: LightFieldTexture) -> tuple[float, float]:
    """Return the change of the place (s, t) where rays cross the grid, in view steps per picture size."""
    across = -2.0 * optics.dolly
    return across, across * field.height / field.width / field.row_step


def is_stored(eye: ViewOffset, field: LightFieldTexture) -> bool:
    """Return whether a present view lies at this viewpoint."""
    row, column = float(eye.t + field.grid.centre[0]), float(eye.s + field.grid.centre[1])
    is_on_grid = 0 <= row < field.grid.rows and 0 <= column < field.grid.columns
    return is_on_grid and row.is_integer() and column.is_integer() and bool(field.present[int(row), int(column)])


def _max_defocus(optics: Optics, range_px: tuple[float, float]) -> float:
    """Return the largest difference between a disparity and the sharp ones."""
    tilt = sum(map(abs, optics.focus_tilt))
    farthest = max(abs(edge - optics.focus_disparity) for edge in range_px) + tilt
    return max(farthest - max(optics.focus_range, 0.0), 0.0)
