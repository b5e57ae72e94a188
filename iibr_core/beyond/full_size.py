"""Views of a photo at its own size, tile by tile, in memory that does not grow with the photo.

The rays of a tile come from the part of the photo around it. Hidden surfaces come from the smaller ray set of the light
field, so a hole shows the same content in both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from iibr_core.beyond.hidden_surfaces import HiddenSurface
from iibr_core.method.rays import RaySet, rays_of_photo
from iibr_core.method.view import Renderer, View, finish
from iibr_core.runtime.tiling import THREADS
from iibr_core.surfaces import SAME_SURFACE_PX
from iibr_core.types import FloatImage, ImageSize, ViewOffset, image_size

TILE_MARGIN_PX = 8
"""Margin of a tile beside the parallax, in pixels, for filters and edges."""


class Part(NamedTuple):
    """Rows [top, bottom) and columns [left, right) of an image; negative ones lie outside its frame."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def size(self) -> ImageSize:
        """Height and width of the part."""
        return ImageSize(self.bottom - self.top, self.right - self.left)

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of the part in an array (H, W, ...)."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def grown(self, by_px: int, within: Part) -> Part:
        """Return the part with `by_px` more pixels on each side, cut off to another part."""
        return Part(
            max(self.top - by_px, within.top),
            min(self.bottom + by_px, within.bottom),
            max(self.left - by_px, within.left),
            min(self.right + by_px, within.right),
        )

    def inside(self, other: Part) -> Part:
        """Return the same part, counted from the upper left corner of another."""
        return Part(self.top - other.top, self.bottom - other.top, self.left - other.left, self.right - other.left)


def whole(size: ImageSize) -> Part:
    """Return all of an image (height, width)."""
    return Part(0, size.height, 0, size.width)


def tiles_of(part: Part, side: int) -> list[Part]:
    """Return a part of an image as tiles of at most side x side pixels, row by row."""
    return [
        Part(top, min(top + side, part.bottom), left, min(left + side, part.right))
        for top in range(part.top, part.bottom, side)
        for left in range(part.left, part.right, side)
    ]


@dataclass(frozen=True, eq=False)
class LargePhoto:
    """A photo at its own size.

    pixels: (H, W, 3), sRGB-encoded. disparity: (H, W), px of this size per view step. fills: complete ray set of a
    light field of the scene, of any size, for inpainted content and for the photo's continuation beyond its frame.
    hidden: the surface behind the photo's, of the light field's size, for open lenses.
    """

    pixels: FloatImage
    disparity: FloatImage
    fills: RaySet | None = None
    hidden: HiddenSurface | None = None

    @property
    def size(self) -> ImageSize:
        """Height and width of the photo."""
        return image_size(self.disparity)

    @cached_property
    def range_px(self) -> FloatImage:
        """Least and greatest disparity (2,), px of the photo per view step."""
        return np.array([self.disparity.min(initial=0.0), self.disparity.max(initial=0.0)], np.float32)

    @cached_property
    def greatest_disparity(self) -> float:
        """Greatest absolute disparity, px of the photo per view step."""
        return float(np.abs(self.disparity).max(initial=0.0))

    @property
    def bounds(self) -> Part:
        """The photo with the margins that `fills` knows."""
        height, width = self.size
        if self.fills is None:
            return whole(self.size)
        ratio_y, ratio_x = height / self.fills.view_size.height, width / self.fills.view_size.width
        top, bottom, left, right = self.fills.margins
        return Part(
            -int(top * ratio_y), height + int(bottom * ratio_y), -int(left * ratio_x), width + int(right * ratio_x)
        )

    def rays(self, part: Part, offsets: Sequence[ViewOffset], farthest_views: float) -> RaySet:
        """Return the rays of a part of the photo for views at these offsets, at most `farthest_views` away."""
        images = [] if self.fills is None else _images_in(self.fills, self.size, part, offsets)
        rays = rays_of_photo(*self._pixels_of(part), farthest_views, len(images))
        for k in images:
            assert self.fills is not None
            rays.add(ViewOffset(*self.fills.arrays.offsets[k]), *_enlarge(self.fills, k, self.size, part))
        return rays

    def _pixels_of(self, part: Part) -> tuple[FloatImage, FloatImage]:
        """Return colours and disparity of a part, which may reach beyond the frame."""
        inside = part.grown(0, whole(self.size))
        if inside == part or self.fills is None:
            return np.ascontiguousarray(self.pixels[inside.slices]), np.ascontiguousarray(self.disparity[inside.slices])
        colors, disparity, _ = _enlarge(self.fills, 0, self.size, part)
        at = inside.inside(part).slices
        colors[at], disparity[at] = self.pixels[inside.slices], self.disparity[inside.slices]
        return colors, disparity


def views_of_tile(photo: LargePhoto, tile: Part, offsets: list[ViewOffset], renderer: Renderer) -> Iterator[View]:
    """Yield the part of the photo's view that a tile shows, for each of these offsets."""
    farthest = max([1.0, *(abs(axis) for offset in offsets for axis in offset)])
    parallax_px = farthest * photo.greatest_disparity
    around = tile.grown(TILE_MARGIN_PX + math.ceil(min(parallax_px, max(photo.size))), photo.bounds)
    rays, shown = photo.rays(around, offsets, farthest), tile.inside(around).slices
    for offset in offsets:
        view = finish(rays, offset, renderer.render(rays, offset, THREADS), THREADS)
        # Copies: a part gets the memory layout of a whole view, so that kernels need not be compiled twice.
        masks = view.occluded[shown].copy(), view.inpainted[shown].copy()
        yield View(view.colors[shown].copy(), view.disparity[shown].copy(), *masks)


def _images_in(fills: RaySet, size: ImageSize, part: Part, offsets: Sequence[ViewOffset]) -> list[int]:
    """Return the indices of inpainted images with rays in a part of a photo of (height, width).

    Only images on the side of one of these offsets count: other surfaces are disoccluded on the other side.
    """
    top, left = fills.margins.top, fills.margins.left
    ratio_y, ratio_x = fills.view_size.height / size.height, fills.view_size.width / size.width
    rows = slice(max(math.floor(part.top * ratio_y) + top, 0), math.ceil(part.bottom * ratio_y) + top)
    columns = slice(max(math.floor(part.left * ratio_x) + left, 0), math.ceil(part.right * ratio_x) + left)
    is_beside = (fills.arrays.offsets[:, None] * np.array(offsets).reshape(1, -1, 2) > 0).any(axis=(1, 2))
    inpainted = range(fills.photo_images, len(fills))
    return [k for k in inpainted if is_beside[k] and fills.arrays.coverage[k, rows, columns].any()]


def _enlarge(fills: RaySet, k: int, size: ImageSize, part: Part) -> tuple[FloatImage, FloatImage, FloatImage]:
    """Return colours, disparity and coverage of a part of image k, enlarged to a photo of (height, width).

    Bilinear among the rays on the surface of the nearest one.
    """
    colors, disparity, coverage = fills.arrays.colors[k], fills.arrays.disparity[k], fills.arrays.coverage[k]
    step_y, step_x = fills.view_size.height / size.height, fills.view_size.width / size.width
    # Pixel areas are aligned at the borders of the frame, hence the halves.
    y = (np.arange(part.top, part.bottom) + 0.5) * step_y - 0.5 + fills.margins.top
    x = (np.arange(part.left, part.right) + 0.5) * step_x - 0.5 + fills.margins.left
    near_y, near_x = (
        np.clip(np.floor(at + 0.5).astype(int), 0, length - 1) for at, length in zip((y, x), disparity.shape)
    )
    large_coverage = coverage[np.ix_(near_y, near_x)]
    row, column = np.nonzero(large_coverage > 0)
    surface = disparity[near_y[row], near_x[column]]
    total, sums = np.zeros(len(row)), np.zeros((len(row), 4))
    for down, across in np.ndindex(2, 2):
        v, u = np.floor(y).astype(int)[row] + down, np.floor(x).astype(int)[column] + across
        is_inside = (v >= 0) & (v < disparity.shape[0]) & (u >= 0) & (u < disparity.shape[1])
        weight = (1 - abs(v - y[row])) * (1 - abs(u - x[column])) * is_inside
        v, u = np.clip(v, 0, disparity.shape[0] - 1), np.clip(u, 0, disparity.shape[1] - 1)
        weight *= (coverage[v, u] > 0) & (abs(disparity[v, u] - surface) <= SAME_SURFACE_PX)
        total += weight
        sums += weight[:, None] * np.column_stack([colors[v, u], np.nan_to_num(disparity[v, u])])
    sums /= total[:, None]
    large_colors, large_disparity = np.zeros((*part.size, 3), np.float32), np.full(part.size, np.nan, np.float32)
    large_colors[row, column], large_disparity[row, column] = sums[:, :3], sums[:, 3] / step_x
    return large_colors, large_disparity, large_coverage
