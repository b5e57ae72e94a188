"""The surface under a place of the photo, for the bucket: connected pixels up to edges of photo and depth."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.brush import CONTOUR_CONTRAST, color_distance, touched_colors, without_outliers
from iibr_core.depth.editing.edits import Stroke
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

COMPARED_APART_PX = 2
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
    colors = without_outliers(colors)
    depth = disparity / np.float32(DEPTH_EDGE * (extent[1] - extent[0]))
    is_edge, contrasts = colors > OTHER_SURFACE * stroke.tolerance, []
    for axis in (0, 1):
        contrast = _contrast(*(image.swapaxes(0, axis) for image in (photo, colors, depth)))
        turned = is_edge.swapaxes(0, axis)
        turned[:-COMPARED_APART_PX] |= contrast > stroke.tolerance
        turned[COMPARED_APART_PX:] |= contrast > stroke.tolerance
        contrasts.append(contrast)
    queue = np.empty(surface.size, np.int32)
    row, column = _nearest_free(~is_edge, int(y * height), int(x * width))
    count = _flood(~is_edge, row * width + column, queue)
    surface.reshape(-1)[queue[:count]] = True
    _grow(surface, is_edge, contrasts)
    _fill_holes(surface, queue, pi * stroke.radius_px(width) ** 2)
    return surface


def _contrast(photo: FloatImage, colors: FloatImage, depth: FloatImage) -> FloatImage:
    """Return the contrast (H - COMPARED_APART_PX, W) between pixels in a column, above 1 between surfaces.

    depth: in steps between surfaces.
    """
    difference = photo[COMPARED_APART_PX:] - photo[:-COMPARED_APART_PX]
    contrast = np.sqrt(np.einsum("yxc,yxc->yx", difference, difference)) / np.float32(CONTOUR_CONTRAST)
    contrast[np.maximum(colors[COMPARED_APART_PX:], colors[:-COMPARED_APART_PX]) <= 0] = 0  # texture
    return np.asarray(np.maximum(contrast, np.abs(depth[COMPARED_APART_PX:] - depth[:-COMPARED_APART_PX])))


def _nearest_free(is_free: Mask, row: int, column: int) -> tuple[int, int]:
    """Return the free pixel nearest to a pixel, as far as edges are wide; the pixel itself without any."""
    top, left, reach = (
        max(row - COMPARED_APART_PX - 1, 0),
        max(column - COMPARED_APART_PX - 1, 0),
        COMPARED_APART_PX + 2,
    )
    places = np.argwhere(is_free[top : row + reach, left : column + reach]) + np.array((top, left))
    if not len(places):
        return row, column
    nearest = places[np.square(places - (row, column)).sum(axis=1).argmin()]
    return int(nearest[0]), int(nearest[1])


def _grow(surface: Mask, is_edge: Mask, contrasts: list[FloatImage]) -> None:
    """Add the pixels of edges that differ less from the surface than from the other side. contrasts: by axis."""
    likes = []
    for axis in (0, 1):
        padded, height = np.pad(contrasts[axis], [(COMPARED_APART_PX, COMPARED_APART_PX), (0, 0)]), surface.shape[axis]
        above, below = padded[:height], padded[COMPARED_APART_PX : height + COMPARED_APART_PX]
        likes.append((above <= below, below <= above))
    for _ in range(COMPARED_APART_PX + 1):
        grown = surface.copy()
        for axis, (is_like_above, is_like_below) in enumerate(likes):
            before, after = surface.swapaxes(0, axis), grown.swapaxes(0, axis)
            after[1:] |= before[:-1] & is_like_above[1:]
            after[:-1] |= before[1:] & is_like_below[:-1]
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
