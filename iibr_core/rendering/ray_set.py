"""The ray set. Every pixel of a source image is a ray with a colour and a disparity; the set is a stack of such images.

The photo comes first; the fringe (what mixed pixels hold of the surface in front) and inpainted views join it. Images
may be larger than the views made of them: so rays beyond the photo's frame belong to the set as well.
"""

from __future__ import annotations

from math import ceil
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.ray_cells import CELL_PX, Cells, largest_steps, over_cells, sum_up
from iibr_core.rendering.rendered_view import RaysBehind
from iibr_core.rendering.slope_connectivity import BELOW, RIGHT, connect_rays, connected_either_way
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.runtime.tiling import in_bands
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.surfaces import EDGE_PX, SMOOTH_SHARE, is_in_front, step_of
from iibr_core.types import FloatImage, ImageSize, Margins, ViewOffset, image_size

NO_MARGINS = Margins()
HIGHEST_LEVEL = 255
GUARD_BAND_PX = 2
"""Inpainted rays this near to those in front are left out, too: else slivers of them appear as isolated outliers."""


class RayArrays(NamedTuple):
    """The rays of S images, as one argument of kernels.

    offsets (S, 2): the view (t, s) each is seen from. colors (S, H, W, 3): sRGB-encoded. disparity (S, H, W): NaN where
    there is no surface. coverage (S, H, W): how much of its pixel a ray fills, 0 = no ray. edge_level (S, H, W): the
    largest step that a 4x4 look-up may meet, in steps between surfaces, rounded up, 0 below one; see `edge_limits`.
    photo_images: so many, from the first on, hold what the photo shows; the others are inpainted.
    """

    offsets: NDArray[np.float64]
    colors: FloatImage
    disparity: FloatImage
    coverage: FloatImage
    edge_level: NDArray[np.uint8]
    photo_images: int


class RaySet:
    """Source images of one size (height, width), at most `capacity` of them. Views show what lies within their margins.

    All arrays are of the images added so far. farthest_views: the largest view offset that will be rendered. margins:
    of the images around every view. connected (H, W): which steps between the photo's rays are a steep surface's
    (`slope_connectivity`). photo_disparity: the photo's, as large as views. photo_images: so many, from the first on,
    hold what the photo shows; others are inpainted.
    """

    def __init__(
        self,
        capacity: int,
        size: ImageSize,
        surface_step: float,
        farthest_views: float = 1.0,
        margins: Margins = NO_MARGINS,
        photo_detail: FloatImage | None = None,
        stages: Stages = ALL_STAGES,
    ) -> None:
        """size: of the images. surface_step: disparities closer than this are one surface for look-ups. photo_detail:
        see there. stages: that are on, for all who make views of the set.
        """
        self._count, self.photo_images = 0, 0
        self.margins, self.stages = margins, stages
        self._surface_step = surface_step
        self.farthest_views = farthest_views
        self._photo_detail, self.photo_disparity = photo_detail, np.empty((0, 0), np.float32)
        self._room = RayArrays(
            np.empty((capacity, 2)),
            np.empty((capacity, *size, 3), np.float32),
            np.empty((capacity, *size), np.float32),
            np.empty((capacity, *size), np.float32),
            np.empty((capacity, *size), np.uint8),
            0,
        )
        in_cells = -(-size.height // CELL_PX), -(-size.width // CELL_PX)
        low, high = (np.empty((capacity, *in_cells), np.float32) for _ in range(2))
        row_ranges = np.empty((capacity, in_cells[0], 2), np.float32)
        self._cells_room = Cells(low, high, row_ranges, np.full(in_cells, np.inf, np.float32))
        self.connected = np.zeros(size, np.uint8)
        self._steep, self._nowhere = np.zeros(in_cells, np.bool_), np.zeros(in_cells, np.bool_)

    def add(
        self,
        offset: ViewOffset,
        colors: FloatImage,
        disparity: FloatImage,
        coverage: FloatImage | NDArray[np.bool_],
        behind: RaysBehind | None = None,
    ) -> None:
        """Add the rays of one image (H, W), or of one view. All but the photo's, which come first, are inpainted: those
        in front of what the photo shows are left out, as it would show them, and those beside them. behind: of a view,
        what counts instead at some pixels. Raises; then nothing is added.
        """
        k, connected, cells = self._count, np.zeros(self.size, np.uint8), self._cells_room
        self._write(k, colors, disparity, coverage, behind)
        disparity, covered = self._room.disparity[k], self._room.coverage[k]
        if k == 0:
            self.photo_disparity = np.ascontiguousarray(self.in_view(disparity))
        if k == 0 and self.stages.connect_slopes:
            self.connected = connected = connect_rays(disparity, self._surface_step)
            if connected.any():
                self._steep = over_cells(np.logical_or, connected_either_way(connected))
        if k > 0 and any(offset) and self.stages.leave_out_in_front:
            edge_step = step_of(EDGE_PX, self.farthest_views)
            _leave_out_in_front(disparity, self._room.disparity[0], *offset, edge_step, covered)

        def band(first: int, last: int) -> None:
            _edge_level(disparity, connected, self._surface_step, first, last, self._room.edge_level[k])
            sum_up(disparity, covered, first, last, cells.low[k], cells.high[k])
            if k == 0:
                largest_steps(disparity, first, last, cells.step)

        in_bands(band, self.size)
        cells.row_ranges[k, :, 0], cells.row_ranges[k, :, 1] = cells.low[k].min(axis=1), cells.high[k].max(axis=1)
        self._room.offsets[k] = offset
        self._count += 1
        self.photo_images += not any(offset)

    def __len__(self) -> int:
        return self._count

    @property
    def size(self) -> ImageSize:
        """Of every image."""
        return image_size(self._room.disparity[0])

    @property
    def view_size(self) -> ImageSize:
        """Of every view."""
        return image_size(self.in_view(self._room.disparity[0]))

    def in_view(self, image: NDArray[Any]) -> NDArray[Any]:
        """The part of an image (H, W, ...) that its view shows."""
        top, bottom, left, right = self.margins
        return image[top : len(image) - bottom, left : image.shape[1] - right]

    @property
    def arrays(self) -> RayArrays:
        """The rays themselves."""
        added, room = slice(self._count), self._room
        return RayArrays(
            room.offsets[added],
            room.colors[added],
            room.disparity[added],
            room.coverage[added],
            room.edge_level[added],
            self.photo_images,
        )

    def to_view(self, offset: ViewOffset) -> NDArray[np.float64]:
        """(S, 2): from where each image is seen to the view at `offset`."""
        return np.array(offset) - self.arrays.offsets

    def edge_limits(self, offset: ViewOffset) -> NDArray[np.uint8]:
        """(S): look-ups for the view at `offset` may meet another surface where a source's edge_level is above this.

        Steps between surfaces are those of the farthest view; in a nearer one they are so much larger.
        """
        from_sources = np.abs(self.to_view(offset)).max(axis=1)
        larger = self.farthest_views / np.maximum(from_sources, 1e-9)
        return np.asarray(np.clip(larger, 1, HIGHEST_LEVEL - 1), np.uint8)

    def smooth_step(self, offset: ViewOffset) -> float:
        """In the view at `offset`, steps of the photo up to this are those of one smooth surface."""
        larger = self.farthest_views / max(*map(abs, offset), 1e-9)
        return SMOOTH_SHARE * self._surface_step * max(larger, 1.0)

    def steep_cells(self, k: int) -> NDArray[np.bool_]:
        """(M, N): cells of image k with connected rays. Only the photo has any."""
        return self._steep if k == 0 else self._nowhere

    @property
    def cells(self) -> Cells:
        """The rays added so far, summarised."""
        added, room = slice(self._count), self._cells_room
        return Cells(room.low[added], room.high[added], room.row_ranges[added], room.step)

    @property
    def photo_detail(self) -> FloatImage:
        """(H, W), as large as images: how far the photo's pixels stand out (`measure_detail`). ValueError where
        the set was made without.
        """
        if self._photo_detail is None:
            raise ValueError("these rays are no photo's: make them by rays_of_photo")
        return self._photo_detail

    def _write(
        self,
        k: int,
        colors: FloatImage,
        disparity: FloatImage,
        coverage: FloatImage | NDArray[np.bool_],
        behind: RaysBehind | None,
    ) -> None:
        """Image k as `add` takes it; there are no rays around what is as small as a view."""
        image = self._room.colors[k], self._room.disparity[k], self._room.coverage[k]
        for room, given, none in zip(image, (colors, disparity, coverage), (0.0, np.nan, 0.0)):
            if image_size(given) == self.size:
                room[:] = given
            else:
                room[:] = none
                self.in_view(room)[:] = given
        if behind is not None:
            at = np.unravel_index(behind.pixel, self.view_size)
            for room, instead in zip(image, (behind.colors, behind.disparity, 1.0)):
                self.in_view(room)[at] = instead


@kernel
def _leave_out_in_front(disparity, photo_disparity, t, s, step, coverage):
    """No coverage for rays seen from (t, s) that lie more than a step in front of the photo's, or beside such a ray.

    Beyond its frame the photo as it is continued counts: what one view inpaints there would cover what it shows.
    """
    height, width = disparity.shape
    made_up = coverage > 0
    for y in range(height):
        for x in range(width):
            if made_up[y, x]:
                d = disparity[y, x]
                v, u = nearest_pixel(y + d * t), nearest_pixel(x + d * s)
                if 0 <= v < height and 0 <= u < width and is_in_front(d, photo_disparity[v, u], step):
                    for j in range(max(y - GUARD_BAND_PX, 0), min(y + GUARD_BAND_PX + 1, height)):
                        for i in range(max(x - GUARD_BAND_PX, 0), min(x + GUARD_BAND_PX + 1, width)):
                            coverage[j, i] = 0.0


@kernel
def _edge_level(disparity, connected, surface_step, first, last, level):
    """Of rows [first, last): the largest step between rays that no surface joins among the 4x4 pixels from
    (x - 1, y - 1) to (x + 2, y + 2), in surface_steps rounded up; HIGHEST_LEVEL where one is unknown, 0 up to one.
    """
    height, width = disparity.shape
    level[first:last] = 0
    # Of one row, with two more pixels on both sides: the steps there; the largest within two pixels.
    steps, largest = np.zeros(width + 4, np.uint8), np.empty(width, np.uint8)
    # Steps in the rows around the band reach into it.
    for y in range(max(first - 2, 0), min(last + 2, height)):
        for x in range(width):
            here = disparity[y, x]
            right = abs(disparity[y, min(x + 1, width - 1)] - here)
            below = abs(disparity[min(y + 1, height - 1), x] - here)
            step = 0.0 if connected[y, x] & RIGHT else right / surface_step
            step = step if connected[y, x] & BELOW or below / surface_step <= step else below / surface_step
            # NaN, no surface, fails the comparison.
            is_known = right + below <= np.inf
            found = np.uint8(ceil(step)) if is_known and step < HIGHEST_LEVEL else np.uint8(HIGHEST_LEVEL)
            # What stays below the first limit counts as nothing: no surface is quite flat.
            steps[x + 2] = found if found > 1 else 0
        for x in range(width):
            largest[x] = max(steps[x], steps[x + 1], steps[x + 2], steps[x + 3], steps[x + 4])
        for v in range(max(y - 2, first), min(y + 3, last)):
            for x in range(width):
                level[v, x] = max(level[v, x], largest[x])
