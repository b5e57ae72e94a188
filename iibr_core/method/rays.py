"""The ray set S of the paper (section 3.1): images of rays, the photo's first, with what views look up of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.outpainting import outpaint
from iibr_core.method.flying_pixels import TEARING_GAP_PX, measure_detail
from iibr_core.method.mixed_pixels import move_with_foreground, split_mixed_pixels
from iibr_core.method.steep_surfaces import BELOW, RIGHT, is_joined, join_steep_rays
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX, SMOOTH_SHARE, is_in_front, step_of
from iibr_core.types import (
    CENTRE,
    FloatImage,
    ImageSize,
    Margins,
    ViewOffset,
    image_size,
)

NO_MARGINS = Margins()
CELL_PX = 4
"""Side of the cells of rays that are skipped or traced as a whole, in pixels."""
GUARD_BAND_PX = 2
"""Distance from an inpainted ray that is left out within which others are left out, too, in pixels: as slivers they
would be outliers.
"""
MIN_STEP_PX = 0.1
"""Smallest step behind which pixels move with the foreground, in px in the outermost view: smaller ones are noise."""


class RayArrays(NamedTuple):
    """The rays of S images, as one argument of kernels.

    photo_images: number of images, from the first on, that hold what the photo shows; the others are inpainted.
    offsets (S, 2): viewpoint (t, s) of each image. colors (S, H, W, 3): sRGB-encoded. disparity (S, H, W): NaN without
    a surface. coverage (S, H, W): share of the pixel that the ray fills, 0 = no ray. near_edge (S, H, W): whether a
    look-up of 4x4 pixels may meet two surfaces. low, high (S, M, N): least and greatest disparity of cells of CELL_PX x
    CELL_PX pixels, (inf, -inf) without rays; row_ranges (S, M, 2): the same of whole rows of cells.
    """

    photo_images: int
    offsets: NDArray[np.float64]
    colors: FloatImage
    disparity: FloatImage
    coverage: FloatImage
    near_edge: NDArray[np.bool_]
    low: FloatImage
    high: FloatImage
    row_ranges: FloatImage


class RaysBehind(NamedTuple):
    """Rays that were inpainted behind what covers a pixel in part.

    pixel (N): index of the view's pixel, row by row. colors (N, 3): sRGB-encoded. disparity (N).
    """

    pixel: NDArray[np.int64]
    colors: FloatImage
    disparity: FloatImage


class RaySet:
    """Images of rays of one size (height, width), at most `capacity` of them.

    farthest_views: largest view offset that will be rendered; steps of disparity are judged there. margins: of the
    images around every view. stages: that are on. photo_images: see `RayArrays`. Of the photo: photo_disparity, at the
    size of views; photo_detail, see `measure_detail`; joined (H, W), rays on steep surfaces, see `join_steep_rays`;
    steep (M, N), cells with such rays; cell_steps (M, N), largest step between the pixels of a cell and their
    neighbours, inf if one is unknown and at the border.
    """

    def __init__(
        self,
        capacity: int,
        size: ImageSize,
        farthest_views: float = 1.0,
        margins: Margins = NO_MARGINS,
        stages: Stages = ALL_STAGES,
    ) -> None:
        """size: of the images, margins included."""
        self.farthest_views, self.margins, self.stages = farthest_views, margins, stages
        self.photo_images, self._count = 0, 0
        self.photo_disparity = self.photo_detail = self.cell_steps = np.empty((0, 0), np.float32)
        cells = -(-size.height // CELL_PX), -(-size.width // CELL_PX)
        shapes = (*size, 3), size, size, cells, cells, (cells[0], 2)
        colors, disparity, coverage, *of_cells = (np.empty((capacity, *shape), np.float32) for shape in shapes)
        near_edge = np.empty((capacity, *size), np.bool_)
        self._room = RayArrays(0, np.empty((capacity, 2)), colors, disparity, coverage, near_edge, *of_cells)
        self.joined, self.steep = np.zeros(size, np.uint8), np.zeros(cells, np.bool_)

    def add(
        self,
        offset: ViewOffset,
        colors: FloatImage,
        disparity: FloatImage,
        coverage: FloatImage | NDArray[np.bool_],
        behind: RaysBehind | None = None,
    ) -> None:
        """Add the rays of an image (H, W), or of a view, which has no margins. The photo's come first.

        behind: of a view, what counts instead at some pixels. Rays in front of what the photo shows are left out: the
        photo would show them.
        """
        k, room, one_surface = self._count, self._room, step_of(SAME_SURFACE_PX, self.farthest_views)
        self._write(k, colors, disparity, coverage, behind)
        disparity, coverage = room.disparity[k], room.coverage[k]
        if k == 0:
            self.photo_disparity = np.ascontiguousarray(self.in_view(disparity))
            self.cell_steps = _block_reduce(np.maximum, _neighbour_steps(disparity))
            if self.stages.connect_slopes:
                self.joined = join_steep_rays(disparity, one_surface)
                self.steep = _block_reduce(np.logical_or, is_joined(self.joined))
        elif any(offset) and self.stages.leave_out_in_front:
            edge_step = step_of(EDGE_PX, self.farthest_views)
            _leave_out_in_front(disparity, room.disparity[0], *offset, edge_step, coverage)
        raise_if_stopped()
        room.near_edge[k] = near_steps(disparity, one_surface, self.joined if k == 0 else None)
        raise_if_stopped()
        known = (coverage > 0) & (disparity == disparity)
        room.low[k] = _block_reduce(np.minimum, np.where(known, disparity, np.float32(np.inf)))
        room.high[k] = _block_reduce(np.maximum, np.where(known, disparity, np.float32(-np.inf)))
        room.row_ranges[k, :, 0], room.row_ranges[k, :, 1] = room.low[k].min(axis=1), room.high[k].max(axis=1)
        room.offsets[k] = offset
        self._count += 1
        self.photo_images += not any(offset)

    def __len__(self) -> int:
        return self._count

    @property
    def size(self) -> ImageSize:
        """Height and width of every image."""
        return image_size(self._room.disparity[0])

    @property
    def view_size(self) -> ImageSize:
        """Height and width of every view."""
        return image_size(self.in_view(self._room.disparity[0]))

    def in_view(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return the part of an image (H, W, ...) that its view shows."""
        top, bottom, left, right = self.margins
        return image[top : len(image) - bottom, left : image.shape[1] - right]

    @property
    def arrays(self) -> RayArrays:
        """The rays added so far."""
        added: list[Any] = [part[: self._count] for part in self._room[1:]]
        return RayArrays(self.photo_images, *added)

    def to_view(self, offset: ViewOffset) -> NDArray[np.float64]:
        """Return the steps (S, 2) from each image to the view at `offset`."""
        return np.array(offset) - self._room.offsets[: self._count]

    def smooth_step(self, offset: ViewOffset) -> float:
        """Return the largest step of the photo that belongs to a smooth surface in the view at `offset`."""
        nearness = self.farthest_views / max(*map(abs, offset), 1e-9)
        return SMOOTH_SHARE * step_of(SAME_SURFACE_PX, self.farthest_views) * max(nearness, 1.0)

    def _write(
        self,
        k: int,
        colors: FloatImage,
        disparity: FloatImage,
        coverage: FloatImage | NDArray[np.bool_],
        behind: RaysBehind | None,
    ) -> None:
        """Write image k; an image of the size of a view gets margins without rays."""
        rooms = self._room.colors[k], self._room.disparity[k], self._room.coverage[k]
        for room, given, nothing in zip(rooms, (colors, disparity, coverage), (0.0, np.nan, 0.0)):
            room[:] = nothing
            shown = room if image_size(given) == self.size else self.in_view(room)
            shown[:] = given
        if behind is not None:
            at = np.unravel_index(behind.pixel, self.view_size)
            for room, instead in zip(rooms, (behind.colors, behind.disparity, 1.0)):
                self.in_view(room)[at] = instead


def rays_of_photo(
    colors: FloatImage,
    disparity: FloatImage,
    farthest_views: float,
    more: int,
    margins: Margins = NO_MARGINS,
    stages: Stages = ALL_STAGES,
) -> RaySet:
    """Return the ray set of a photo (H, W, 3) with its disparity (H, W), with room for `more` images.

    It holds the photo's own rays, continued into the margins, and the fringe of its mixed pixels. farthest_views: the
    largest view offset that will be rendered; it decides which steps of disparity are depth edges.
    """
    colors, disparity = outpaint(colors, disparity, margins, stages)
    centre, edge_step = CENTRE, step_of(EDGE_PX, farthest_views)
    size = image_size(disparity)
    rays, everywhere = RaySet(2 + more, size, farthest_views, margins, stages), np.ones(size, np.bool_)
    if stages.remove_flying_pixels:
        tears = near_steps(disparity, step_of(TEARING_GAP_PX, farthest_views))
        rays.photo_detail = measure_detail(np.ascontiguousarray(colors), tears)
    if not stages.split_mixed_pixels:
        rays.add(centre, colors, disparity, everywhere)
        return rays
    background, fringe, fringe_disparity, coverage = split_mixed_pixels(colors, disparity, edge_step)
    disparity = move_with_foreground(disparity, (step_of(MIN_STEP_PX, farthest_views), edge_step))
    rays.add(centre, background, disparity, everywhere)
    if coverage.any():
        rays.add(centre, fringe, fringe_disparity, coverage)
    return rays


def near_steps(disparity: FloatImage, step: float, joined: NDArray[np.uint8] | None = None) -> NDArray[np.bool_]:
    """Return where (H, W) a look-up of 4x4 pixels may meet neighbours that differ by more than a step, or are NaN.

    joined: neighbours that one steep surface joins, see `join_steep_rays`.
    """
    is_step = ~np.isfinite(disparity)
    # NaN fails the comparison, hence "not at most".
    across, down = ~(np.abs(np.diff(disparity, axis=1)) <= step), ~(np.abs(np.diff(disparity, axis=0)) <= step)
    if joined is not None:
        across &= joined[:, :-1] & RIGHT == 0
        down &= joined[:-1] & BELOW == 0
    is_step[:, :-1] |= across
    is_step[:-1] |= down
    for axis in (0, 1):
        raise_if_stopped()
        is_step, source = is_step.copy(), np.moveaxis(is_step, axis, 0)
        near = np.moveaxis(is_step, axis, 0)
        for px in (1, 2):
            near[px:] |= source[:-px]
            near[:-px] |= source[px:]
    return is_step


def _neighbour_steps(disparity: FloatImage) -> FloatImage:
    """Return the largest step (H, W) from each pixel to its four neighbours, inf at the border and beside NaN."""
    steps = np.full(disparity.shape, np.inf, np.float32)
    across, down = np.abs(np.diff(disparity, axis=1)), np.abs(np.diff(disparity, axis=0))
    largest = np.maximum(across[:, :-1], across[:, 1:])[1:-1]
    np.maximum(largest, np.maximum(down[:-1], down[1:])[:, 1:-1], out=largest)
    steps[1:-1, 1:-1] = np.where(np.isnan(largest), np.float32(np.inf), largest)
    return steps


def _block_reduce(combine: np.ufunc, pixels: NDArray[Any]) -> NDArray[Any]:
    """Return the pixels (H, W) of each cell, combined, (M, N)."""
    rows, columns = (np.arange(0, length, CELL_PX) for length in pixels.shape)
    return np.asarray(combine.reduceat(combine.reduceat(pixels, rows, 0), columns, 1))


@kernel
def _leave_out_in_front(disparity, photo_disparity, t, s, step, coverage):
    """Set coverage to 0 for rays seen from (t, s) more than a step in front of the photo's, and beside such rays.

    Beyond its frame, the continued photo counts: what one view inpaints there would cover what it shows.
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
