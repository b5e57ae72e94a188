"""The surface under a place of the photo, for the bucket: connected pixels up to edges of photo and depth."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.brush import CONTOUR_CONTRAST, color_distance, touched_colors, without_specks
from iibr_core.depth.editing.edits import Stroke
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

EDGE_PX = 2
"""Distance of the pixels that are compared: edges may be blurred, and gaps up to twice as wide are closed."""
DEPTH_EDGE = 0.05
"""Step of disparity between surfaces, as a share of the map's range."""
OTHER_SURFACE = 0.25
"""Color distance from the touched colours that is another surface, however softly colours change."""

Mask = NDArray[np.bool_]


def surface_at(
    photo: FloatImage, disparity: FloatImage, stroke: Stroke, index: int, extent: tuple[float, float]
) -> Mask:
    """Return the pixels (H, W) of the surface under the stroke's point of this index; none if that lies outside.

    Colours that the stroke touched have no edges between them. Holes smaller than the brush are filled. disparity:
    (H, W), finite. extent: see `extent_of`.
    """
    height, width = disparity.shape
    x, y = stroke.points[index]
    surface = np.zeros(disparity.shape, np.bool_)
    if not (0 <= x < 1 and 0 <= y < 1):
        return surface
    colors = color_distance(photo.reshape(-1, 3), touched_colors(photo, stroke, index)).reshape(disparity.shape)
    colors = without_specks(colors)
    images = photo, colors, disparity / np.float32(DEPTH_EDGE * (extent[1] - extent[0]))
    is_edge = colors > OTHER_SURFACE
    for axis in (0, 1):
        steps = _find_steps(*images, axis, EDGE_PX)
        near, far = _pair(is_edge, axis, EDGE_PX)
        near |= steps
        far |= steps
    queue = np.empty(surface.size, np.int32)
    row, column = _nearest_free(~is_edge, int(y * height), int(x * width))
    count = _flood(~is_edge, row * width + column, queue)
    surface.reshape(-1)[queue[:count]] = True
    _grow(surface, is_edge, [_find_steps(*images, axis, 1) for axis in (0, 1)])
    _fill_holes(surface, queue, pi * stroke.radius_px(width) ** 2)
    return surface


def _pair(image: np.ndarray, axis: int, px: int) -> tuple[np.ndarray, np.ndarray]:
    """Return two views of an image (H, W, ...) whose pixels lie px apart along an axis."""
    return (image[:-px], image[px:]) if axis == 0 else (image[:, :-px], image[:, px:])


def _find_steps(photo: FloatImage, colors: FloatImage, depth: FloatImage, axis: int, px: int) -> Mask:
    """Return whether pixels px apart belong to two surfaces, by colour or by depth (in steps between surfaces)."""
    difference = np.subtract(*_pair(photo, axis, px))
    contrast = np.sqrt(np.einsum("yxc,yxc->yx", difference, difference))
    contrast[np.maximum(*_pair(colors, axis, px)) <= 0] = 0  # texture
    before, behind = _pair(depth, axis, px)
    return np.asarray((contrast > CONTOUR_CONTRAST) | (np.abs(before - behind) > 1))


def _nearest_free(is_free: Mask, row: int, column: int) -> tuple[int, int]:
    """Return the free pixel nearest to a pixel, as far as edges are wide; the pixel itself without any."""
    top, left, reach = max(row - EDGE_PX - 1, 0), max(column - EDGE_PX - 1, 0), EDGE_PX + 2
    places = np.argwhere(is_free[top : row + reach, left : column + reach]) + np.array((top, left))
    if not len(places):
        return row, column
    nearest = places[np.square(places - (row, column)).sum(axis=1).argmin()]
    return int(nearest[0]), int(nearest[1])


def _grow(surface: Mask, is_edge: Mask, steps: list[Mask]) -> None:
    """Add the pixels of edges on the surface's side. steps: between neighbours, by axis."""
    for _ in range(EDGE_PX + 1):
        grown = surface.copy()
        for axis in (0, 1):
            (near, far), (to_near, to_far) = _pair(surface, axis, 1), _pair(grown, axis, 1)
            to_near |= far & ~steps[axis]
            to_far |= near & ~steps[axis]
        surface |= grown & is_edge


@kernel
def _flood(is_free, start, queue):
    """Flood fill from a pixel, by its index (4-connected). Overwrites `is_free`.

    Return the number of pixels; `queue` begins with their indices.
    """
    height, width = is_free.shape
    queue[0], at, end = start, 0, 1
    is_free[start // width, start % width] = False
    while at < end:
        y, x = queue[at] // width, queue[at] % width
        at += 1
        for turn in range(4):
            v, u = y + (turn == 0) - (turn == 1), x + (turn == 2) - (turn == 3)
            if 0 <= v < height and 0 <= u < width and is_free[v, u]:
                is_free[v, u] = False
                queue[end] = v * width + u
                end += 1
    return end


@kernel
def _fill_holes(surface, queue, max_pixels):
    """Add the holes of a surface of at most max_pixels each."""
    height, width = surface.shape
    is_free = ~surface
    for start in range(height * width):
        if not is_free[start // width, start % width]:
            continue
        count = _flood(is_free, start, queue)
        is_hole = count <= max_pixels
        for k in range(count):
            is_hole &= 0 < queue[k] // width < height - 1 and 0 < queue[k] % width < width - 1
        for k in range(count if is_hole else 0):
            surface[queue[k] // width, queue[k] % width] = True
