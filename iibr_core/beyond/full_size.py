"""Views of a photo at its own size, a tile at a time: memory stays flat however large it is.

The rays of a tile are those of the photo's part around it; what the photo hides comes from the ray set of the light
field, which is smaller: so a hole shows the same in both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from iibr_core.method.rays import RaySet, rays_of_photo
from iibr_core.method.view import Renderer, View, finish
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import THREADS
from iibr_core.surfaces import SAME_SURFACE_PX, same_surface
from iibr_core.types import (
    FloatImage,
    ImageSize,
    ViewOffset,
    image_size,
)

TILE_PX = 1024
"""Side of a tile, what lies around it not counted."""
TILE_MARGIN_PX = 8
"""What lies around a tile beside the parallax: filters and edges reach so far."""


class Part(NamedTuple):
    """Rows [top, bottom) and columns [left, right) of an image; below 0 they lie beyond its frame."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def size(self) -> ImageSize:
        """Of the part."""
        return ImageSize(self.bottom - self.top, self.right - self.left)

    @property
    def slices(self) -> tuple[slice, slice]:
        """To take it out of an array (H, W, ...)."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def grown(self, by_px: int, within: Part) -> Part:
        """With so much around it, as far as another part goes."""
        return Part(
            max(self.top - by_px, within.top),
            min(self.bottom + by_px, within.bottom),
            max(self.left - by_px, within.left),
            min(self.right + by_px, within.right),
        )

    def inside(self, other: Part) -> Part:
        """The same part, counted from the corner of another."""
        return Part(self.top - other.top, self.bottom - other.top, self.left - other.left, self.right - other.left)


def whole(size: ImageSize) -> Part:
    """All of an image (height, width)."""
    return Part(0, size.height, 0, size.width)


def tiles_of(part: Part, side: int = TILE_PX) -> list[Part]:
    """A part of an image in tiles of at most side x side pixels, row by row."""
    return [
        Part(top, min(top + side, part.bottom), left, min(left + side, part.right))
        for top in range(part.top, part.bottom, side)
        for left in range(part.left, part.right, side)
    ]


@dataclass(frozen=True, eq=False)
class LargePhoto:
    """A photo at its own size. pixels: (H, W, 3) sRGB-encoded. disparity: (H, W), px of it per view step. fills: the
    complete ray set of a light field of the same scene, of whatever size: what it inpainted, and how it continued the
    photo beyond its frame, is taken over.
    """

    pixels: FloatImage
    disparity: FloatImage
    fills: RaySet | None = None

    @property
    def size(self) -> ImageSize:
        """Of the photo."""
        return image_size(self.disparity)

    @cached_property
    def greatest_disparity(self) -> float:
        """Greatest disparity either way, px of the photo per view step."""
        return float(np.abs(self.disparity).max(initial=0.0))

    def with_fills(self, fills: RaySet | None) -> LargePhoto:
        """The same with what was inpainted."""
        return replace(self, fills=fills)

    def rays(self, part: Part, offsets: Sequence[ViewOffset]) -> RaySet:
        """The rays of a part of it that may show from these offsets."""
        farthest_views = max([1.0, *(abs(axis) for offset in offsets for axis in offset)])
        fills = [] if self.fills is None else _fills_in(self.fills, self.size, part, offsets)
        rays = rays_of_photo(*self._rays_of_frame(part), farthest_views, len(fills))
        for k in fills:
            assert self.fills is not None
            rays.add(ViewOffset(*self.fills.arrays.offsets[k]), *_enlarge(self.fills, k, self.size, part))
        return rays

    @property
    def bounds(self) -> Part:
        """As far as it is known beyond its frame."""
        height, width = self.size
        if self.fills is None:
            return whole(self.size)
        ratio_y, ratio_x = height / self.fills.view_size.height, width / self.fills.view_size.width
        top, bottom, left, right = self.fills.margins
        down, across = (int(top * ratio_y), int(bottom * ratio_y)), (int(left * ratio_x), int(right * ratio_x))
        return Part(-down[0], height + down[1], -across[0], width + across[1])

    def _rays_of_frame(self, part: Part) -> tuple[FloatImage, FloatImage]:
        """Colours and disparity of a part, continued where it lies beyond the frame."""
        inside = part.grown(0, whole(self.size))
        if inside == part or self.fills is None:
            return np.ascontiguousarray(self.pixels[inside.slices]), np.ascontiguousarray(self.disparity[inside.slices])
        colors, disparity, _ = _enlarge(self.fills, 0, self.size, part)
        at = inside.inside(part).slices
        colors[at], disparity[at] = self.pixels[inside.slices], self.disparity[inside.slices]
        return colors, disparity


def views_of_tile(photo: LargePhoto, tile: Part, offsets: list[ViewOffset], renderer: Renderer) -> Iterator[View]:
    """What a tile of the photo shows from these offsets, one view after the other.

    Raises ValueError for offsets that are not finite.
    """
    farthest = max([1.0, *(abs(axis) for offset in offsets for axis in offset)])
    parallax_px = farthest * photo.greatest_disparity
    around = tile.grown(TILE_MARGIN_PX + math.ceil(min(parallax_px, max(photo.size))), photo.bounds)
    rays, shown = photo.rays(around, offsets), tile.inside(around).slices
    for offset in offsets:
        view = finish(rays, offset, renderer.render(rays, offset, THREADS), THREADS)
        # Copies: a part is laid out like a whole view, and kernels need no second kind.
        yield View(
            view.colors[shown].copy(),
            view.disparity[shown].copy(),
            view.occluded[shown].copy(),
            view.inpainted[shown].copy(),
        )


def _fills_in(fills: RaySet, size: ImageSize, part: Part, offsets: Sequence[ViewOffset]) -> list[int]:
    """Indices of the inpainted images that have rays in this part of a photo of (height, width), and that lie on the
    side of one of these offsets: from the other side other things are disclosed.
    """
    rows, columns = (slice(low, high) for low, high in _under(part, size, fills))
    alike = (fills.arrays.offsets[:, None] * np.array(offsets).reshape(1, -1, 2) > 0).any(axis=(1, 2))
    return [
        k for k in range(fills.photo_images, len(fills)) if alike[k] and fills.arrays.coverage[k, rows, columns].any()
    ]


def _under(part: Part, size: ImageSize, fills: RaySet) -> tuple[tuple[int, int], tuple[int, int]]:
    """Rows and columns of the images of a ray set that a part of the same photo at another (height, width) covers."""
    ratio_y, ratio_x = fills.view_size.height / size.height, fills.view_size.width / size.width
    top, left = fills.margins.top, fills.margins.left
    return (
        (max(math.floor(part.top * ratio_y) + top, 0), math.ceil(part.bottom * ratio_y) + top),
        (max(math.floor(part.left * ratio_x) + left, 0), math.ceil(part.right * ratio_x) + left),
    )


def _enlarge(fills: RaySet, k: int, size: ImageSize, part: Part) -> tuple[FloatImage, FloatImage, FloatImage]:
    """Colours, disparity and coverage of a part of image k as it is at another (height, width) of the photo:
    interpolated between rays of one surface.
    """
    found = (
        np.zeros((*part.size, 3), np.float32),
        np.full(part.size, np.nan, np.float32),
        np.zeros(part.size, np.float32),
    )
    _enlarge_rays(
        fills.arrays, k, fills.margins.top, fills.margins.left,
        fills.view_size.height / size.height, fills.view_size.width / size.width, part.top, part.left, *found,
    )  # fmt: skip
    return found


@kernel
def _enlarge_rays(
    fills, k, margin_top, margin_left, step_y, step_x, top, left, large_colors, large_disparity, large_coverage
):  # fmt: skip
    """Fill the last three, a part from (top, left) of a larger image, from image k of the fills, which has margins and
    of which a larger pixel covers step_y x step_x.
    """
    colors, disparity, coverage = fills.colors[k], fills.disparity[k], fills.coverage[k]
    for row in range(large_disparity.shape[0]):
        # Pixel areas are aligned at the borders of the frame, hence the halves.
        y = (top + row + 0.5) * step_y - 0.5 + margin_top
        for column in range(large_disparity.shape[1]):
            x = (left + column + 0.5) * step_x - 0.5 + margin_left
            near_y = min(max(math.floor(y + 0.5), 0), disparity.shape[0] - 1)
            near_x = min(max(math.floor(x + 0.5), 0), disparity.shape[1] - 1)
            if not coverage[near_y, near_x] > 0:
                continue
            own = disparity[near_y, near_x]
            total, depth, red, green, blue = 0.0, 0.0, 0.0, 0.0, 0.0
            for v in range(max(math.floor(y), 0), min(math.floor(y) + 2, disparity.shape[0])):
                for u in range(max(math.floor(x), 0), min(math.floor(x) + 2, disparity.shape[1])):
                    # Of the nearest ray's surface only; NaN, no surface, fails the comparison.
                    if not (coverage[v, u] > 0 and same_surface(disparity[v, u], own, SAME_SURFACE_PX)):
                        continue
                    weight = (1.0 - abs(v - y)) * (1.0 - abs(u - x))
                    total += weight
                    depth += weight * disparity[v, u]
                    red += weight * colors[v, u, 0]
                    green += weight * colors[v, u, 1]
                    blue += weight * colors[v, u, 2]
            if not total > 0:
                continue
            large_coverage[row, column] = coverage[near_y, near_x]
            large_disparity[row, column] = depth / total / step_x
            large_colors[row, column, 0] = red / total
            large_colors[row, column, 1] = green / total
            large_colors[row, column, 2] = blue / total
