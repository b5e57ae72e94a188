"""A glossy surface in the views of a light field. Each view is shaded as it arrives, from its own disparity.

result = matt (1 - a) + light a in linear light, where a is the share that the lobe reflects: never more than the light.
`shaders/include/gloss.glsl` does the same for the window.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np

from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.microfacet import reflected_share, unit
from iibr_core.gloss.normals import fit_normals
from iibr_core.gloss.settings import Gloss, GlossSurface
from iibr_core.gloss.surface_mask import surface_mask
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar, nearest_pixel, srgb_scalar
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import EDGE_PX
from iibr_core.types import FloatImage, ViewOffset, ViewUpdate, image_size


@dataclass(frozen=True, eq=False)
class GlossMaps:
    """A glossy surface in the pixels of the photo. normals: (H, W, 3). disparity, mask: (H, W)."""

    surface: GlossSurface
    geometry: SceneGeometry
    normals: FloatImage
    disparity: FloatImage
    mask: FloatImage

    @cached_property
    def packed(self) -> FloatImage:
        """Normal's x and y, mask and disparity, (H, W, 4)."""
        return np.dstack([self.normals[..., :2], self.mask, self.disparity])

    @cached_property
    def min_nearness(self) -> float:
        """Nearness of the farthest pixel."""
        return float(self.geometry.nearness(self.disparity).min())


def make_gloss_maps(
    surface: GlossSurface,
    photo: FloatImage,
    disparity: FloatImage,
    geometry: SceneGeometry,
    normals: FloatImage | None = None,
) -> GlossMaps:
    """Return the maps of a surface.

    photo: (H, W, 3), sRGB-encoded. disparity: (H, W), of the light field. normals: from `fit_normals`, if known.
    """
    if normals is None:
        normals = fit_normals(disparity, geometry)
    return GlossMaps(surface, geometry, normals, disparity, surface_mask(surface, photo, disparity))


def shade_views(
    views: Iterator[ViewUpdate], gloss: Gloss, maps: GlossMaps, offset_of: Callable[[int, int], ViewOffset]
) -> Iterator[ViewUpdate]:
    """Yield the views with their gloss. Views without disparity stay as they are.

    offset_of: viewpoint by row and column, in the steps that disparity counts.
    """
    is_empty = not maps.mask.any()
    for view in views:
        if view.disparity is None or is_empty:
            yield view
            continue
        colors = encoded_from_stored(view.colors)
        shade(colors, view.disparity, offset_of(view.row, view.column), gloss, maps)
        yield replace(view, colors=stored_from_encoded(colors, view.colors.dtype != np.uint8))


def shade(colors: FloatImage, disparity: FloatImage, offset: ViewOffset, gloss: Gloss, maps: GlossMaps) -> None:
    """Add gloss to the sRGB-encoded colours (H, W, 3) of the view at an offset. disparity: (H, W), of that view."""
    lens = (float(offset.t), float(offset.s), *maps.geometry, maps.min_nearness)
    light, radiance, lobe, packed = gloss.light.unit_direction, gloss.light.radiance, gloss.lobe, maps.packed

    def shade_band(first: int, last: int) -> None:
        _shade_rows(colors, disparity, packed, lens, (light, radiance, lobe), first, last)

    in_bands(shade_band, image_size(colors))


@kernel
def _shade_rows(colors, disparity, packed, lens, lighting, first, last):
    """Shade rows [first, last). lens: t, s, focal length, disparity at infinity, least nearness."""
    height, width = disparity.shape
    t, s, focal, infinity, min_nearness = lens
    light, radiance, lobe = lighting
    for y in range(first, last):
        for x in range(width):
            d = disparity[y, x]
            v, u = y + d * t, x + d * s
            if v <= -0.5 or v >= height - 0.5 or u <= -0.5 or u >= width - 0.5:
                continue
            change = packed[nearest_pixel(v), nearest_pixel(u), 3] - d
            if change * change * (t * t + s * s) > EDGE_PX * EDGE_PX:
                continue  # the photo shows another surface there
            mask = _bilinear(packed, v, u, 2)
            if mask <= 0:
                continue
            nx, ny = _bilinear(packed, v, u, 0), _bilinear(packed, v, u, 1)
            normal = nx, ny, -sqrt(max(1 - nx * nx - ny * ny, 0.0))
            near = max(d - infinity, min_nearness)
            to_eye = unit((s - (u - (width - 1) / 2) / near, t - (v - (height - 1) / 2) / near, -focal / near))
            share = mask * reflected_share(normal, to_eye, light, lobe)
            if share > 0:
                for c in range(3):
                    linear = linear_scalar(colors[y, x, c])
                    colors[y, x, c] = srgb_scalar(linear + share * (radiance[c] - linear))


@kernel
def _bilinear(image, y, x, channel):
    """Return one channel of an image (H, W, C) at a place; clamped at its borders."""
    height, width = image.shape[:2]
    y, x = min(max(y, 0.0), height - 1.0), min(max(x, 0.0), width - 1.0)
    top, left = int(y), int(x)
    below, right = min(top + 1, height - 1), min(left + 1, width - 1)
    v, u = y - top, x - left
    upper = (1 - u) * image[top, left, channel] + u * image[top, right, channel]
    lower = (1 - u) * image[below, left, channel] + u * image[below, right, channel]
    return (1 - v) * upper + v * lower
