"""Triangles over a disparity map: few on smooth surfaces, small ones along depth edges, where surfaces are cut apart.

Right triangles are halved at their longest side until the map is met (Evans et al. 2001), all over one array: no
triangle ends in the middle of another's side. Vertices are corners of pixels, so that every pixel is covered by its
own surface: a corner between two surfaces is a vertex of each.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage

MAX_ERROR_PX = 0.15
"""Largest error of triangles, in pixels of the outermost view and of the texture."""
GREATEST_ERROR_PX = 2.0
"""Error up to which it is raised where there are too many triangles."""
BLOCK_PX = 64
"""Side of the largest triangles in pixels, a power of two."""
MAX_TRIANGLES = 600_000
"""Number of triangles of one map above which errors are raised."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles of a map. corners: (N, 2), columns and rows of vertices, counted from the picture's upper left corner.

    nearness: (N,). indices: (M, 3), counter-clockwise where y points up.
    """

    corners: FloatImage
    nearness: FloatImage
    indices: NDArray[np.uint32]


def triangulate(nearness: FloatImage, mask: Mask, joins: tuple[Mask, Mask], views: float) -> Triangles:
    """Return triangles that cover the pixels of a mask.

    nearness: (H, W), positive, the disparity beyond that of infinitely far points, in pixels per view step. mask: (H,
    W). joins: (H, W - 1) and (H - 1, W), whether a pixel and the next one, to the right or below, are on one surface.
    views: view steps to the outermost view. More than MAX_TRIANGLES raise the error.
    """
    height, width = (-(-side // BLOCK_PX) * BLOCK_PX for side in mask.shape)
    padding = [(1, height + 1 - mask.shape[0]), (1, width + 1 - mask.shape[1])]
    pad = partial(np.pad, pad_width=padding)
    covered, values = pad(mask), pad(np.where(mask, nearness, 0).astype(np.float32))
    right = pad(np.pad(joins[0], [(0, 0), (0, 1)])) & covered & np.roll(covered, -1, axis=1)
    below = pad(np.pad(joins[1], [(0, 1), (0, 0)])) & covered & np.roll(covered, -1, axis=0)
    labels = _label_surfaces(right, below)
    heights = _heights(values, covered, labels)
    here = _quadrants(covered)
    first = np.argmax(here, axis=0)[None]
    is_cut = here.any(axis=0) & ~(here.all(axis=0) & (labels == 0).all(axis=0))
    errors = _errors(np.take_along_axis(heights, first, axis=0)[0], is_cut, views)
    triangles, error = _split(errors, MAX_ERROR_PX), MAX_ERROR_PX
    while len(triangles) > MAX_TRIANGLES and error < GREATEST_ERROR_PX:
        error *= 2
        triangles = _split(errors, error)
    return _with_vertices(triangles, covered[1:, 1:], labels, heights)


def _quadrants(image: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return the pixels (4, H - 1, W - 1) above left, above right, below left and below right of each corner."""
    return np.stack([image[:-1, :-1], image[:-1, 1:], image[1:, :-1], image[1:, 1:]])


def _label_surfaces(right: Mask, below: Mask) -> NDArray[np.uint8]:
    """Return the surface (4, H, W) of each pixel around a corner: the number of its first pixel, 0 to 3."""
    pairs = [(0, 1, right[:-1, :-1]), (1, 3, below[:-1, 1:]), (2, 3, right[1:, :-1]), (0, 2, below[:-1, :-1])]
    labels = np.empty((4, *pairs[0][2].shape), np.uint8)
    labels[:] = np.arange(4, dtype=np.uint8)[:, None, None]
    for one, other, is_joined in pairs * 3:
        least = np.minimum(labels[one], labels[other])
        labels[one], labels[other] = (np.where(is_joined, least, labels[k]) for k in (one, other))
    return labels


def _heights(values: FloatImage, covered: Mask, labels: NDArray[np.uint8]) -> FloatImage:
    """Return the mean nearness (4, H, W) of the surface of each pixel around a corner, 0 where nothing is covered."""
    around, here = _quadrants(values), _quadrants(covered)
    heights = np.zeros_like(around)
    for k in range(4):
        alike = (labels == labels[k]) & here
        heights[k] = (around * alike).sum(axis=0) / np.maximum(alike.sum(axis=0), 1)
    return heights


def _errors(heights: FloatImage, is_cut: Mask, views: float) -> FloatImage:
    """Return the error in pixels at each corner if the side that it halves is not halved, and none within.

    heights, is_cut: (H, W) corners, sides 1 more than a multiple of BLOCK_PX. At cuts it is infinite.
    """
    errors = np.where(is_cut, np.float32(np.inf), np.float32(0))
    for step in (2**k for k in range(1, BLOCK_PX.bit_length())):
        half, quarter = step // 2, step // 4
        for error, height in ((errors, heights), (errors.T, heights.T)):
            middle, ends = error[::step, half::step], height[::step, ::step]
            own = _side_error(ends[:, :-1], ends[:, 1:], height[::step, half::step], step, views)
            np.maximum(middle, own, out=middle)
            for side in (half - quarter, half + quarter) if quarter else ():
                np.maximum(middle[:-1], error[quarter::step, side::step], out=middle[:-1])
                np.maximum(middle[1:], error[step - quarter :: step, side::step], out=middle[1:])
        start, end = _diagonals(heights[::step, ::step])
        own = _side_error(start, end, heights[half::step, half::step], step * math.sqrt(2), views)
        above, beside = errors[::step, half::step], errors[half::step, ::step]
        within = [errors[half::step, half::step], above[:-1], above[1:], beside[:, :-1], beside[:, 1:]]
        errors[half::step, half::step] = np.max([own, *within], axis=0)
    return errors


def _diagonals(corners: FloatImage) -> tuple[FloatImage, FloatImage]:
    """Return the ends of the diagonal of each square: of two neighbours, one falls and one rises."""
    rows, columns = np.indices([side - 1 for side in corners.shape], sparse=True)
    falls = (rows + columns) % 2 == 0
    start = np.where(falls, corners[:-1, :-1], corners[:-1, 1:])
    return start, np.where(falls, corners[1:, 1:], corners[1:, :-1])


def _side_error(start: FloatImage, end: FloatImage, middle: FloatImage, length: float, views: float) -> FloatImage:
    """Return the error in pixels of a side that is not halved: of its place in the outermost view, and of its texture.

    A texture lies linearly on a surface, which is not how a camera projects it where one end is nearer.
    """
    place = abs((start + end) / 2 - middle) * np.float32(views)
    texture = abs(start - end) * np.float32(length / 2) / np.maximum(start + end, np.float32(1e-9))
    return np.asarray(np.maximum(place, texture))


def _split(errors: FloatImage, max_error: float) -> NDArray[np.int32]:
    """Return the triangles (N, 3, 2), rows and columns of corners, whose longest sides need no halving.

    The longest side leads from the first corner to the second.
    """
    rows, columns = np.indices([side // BLOCK_PX for side in errors.shape]).reshape(2, -1, 1)
    top, left, is_even = rows * BLOCK_PX, columns * BLOCK_PX, (rows + columns) % 2 == 0
    square = np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) * BLOCK_PX  # as `_quadrants`
    halves = [np.where(is_even, even, odd) for even, odd in (([3, 0, 2], [2, 1, 0]), ([0, 3, 1], [1, 2, 3]))]
    waiting = np.concatenate([square[half] + np.stack([top, left], axis=-1) for half in halves]).astype(np.int32)
    finished = []
    while len(waiting):
        middle = waiting[:, 0] + waiting[:, 1]
        splits = ~(middle % 2).any(axis=1)
        middle //= 2
        splits &= errors[middle[:, 0], middle[:, 1]] > max_error
        finished.append(waiting[~splits])
        (start, end, apex), middle = waiting[splits].transpose(1, 0, 2), middle[splits]
        waiting = np.concatenate([np.stack([apex, start, middle], 1), np.stack([end, apex, middle], 1)])
    return np.concatenate(finished)


def _with_vertices(
    triangles: NDArray[np.int32], covered: Mask, labels: NDArray[np.uint8], heights: FloatImage
) -> Triangles:
    """Return those triangles that lie in covered pixels, with a vertex a corner and surface."""
    middles = triangles.mean(axis=1)
    is_covered = covered[tuple(middles.astype(int).T)]
    triangles, middles = triangles[is_covered], middles[is_covered]
    rows, columns = triangles[..., 0], triangles[..., 1]
    is_below, is_right = (triangles < middles[:, None]).transpose(2, 0, 1)
    surface = labels[2 * is_below + is_right, rows, columns]
    numbers = np.ravel_multi_index((surface, rows, columns), labels.shape)
    vertices, indices = np.unique(numbers, return_inverse=True)
    _, y, x = np.unravel_index(vertices, labels.shape)
    corners = np.stack([x, y], axis=-1).astype(np.float32)
    return Triangles(corners, heights.reshape(-1)[vertices], indices.reshape(-1, 3).astype(np.uint32))
