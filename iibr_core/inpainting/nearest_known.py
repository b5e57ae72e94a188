"""What is known around holes: the nearest known pixel in each of sixteen directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands, in_pieces
from iibr_core.types import image_size

DIRECTIONS = np.array(
    [
        (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1),
        (2, 1), (-2, 1), (2, -1), (-2, -1), (1, 2), (-1, 2), (1, -2), (-1, -2),
    ]
)  # fmt: skip
MOST_PIECE_PIXELS = 1 << 15
"""Hole pixels that are filled between two questions whether to stop."""


class AroundHoles(NamedTuple):
    """pixels (N,): flat indices of the hole pixels, ascending. number (H, W): see `number_pixels`. known (N, 16): flat
    indices of the known pixels around each, one a direction, -1 if there is none.
    """

    pixels: NDArray[np.int64]
    number: NDArray[np.int32]
    known: NDArray[np.int32]


def nearest_known(hole: NDArray[np.bool_], threads: int) -> AroundHoles:
    """What is around holes (H, W)."""
    size = image_size(hole)

    def band(first: int, last: int) -> NDArray[np.int64]:
        return first * size.width + np.flatnonzero(hole[first:last])

    pixels, number = np.concatenate(in_bands(band, size, threads)), np.empty(size, np.int32)
    number_pixels(pixels, number)
    known = np.empty((len(pixels), len(DIRECTIONS)), np.int32)

    def look(k: int) -> None:
        _nearest_known_towards(hole, pixels, number, *DIRECTIONS[k], known, k)

    in_pieces(look, range(len(DIRECTIONS)), threads)
    return AroundHoles(pixels, number, known)


@kernel
def number_pixels(pixels, number):
    """Write to number (H, W) which one of these pixels (N,), flat indices, each of them is."""
    width = number.shape[1]
    for i in range(len(pixels)):
        number[pixels[i] // width, pixels[i] % width] = i


@kernel
def _nearest_known_towards(hole, pixels, number, step_x, step_y, known, k):
    """What `nearest_known` returns, for direction k: a column of it would be another kind of array where N is 1.

    pixels: flat indices of the hole pixels, ascending. Holes pass on what the next pixel in that direction found, so
    the cost does not depend on the holes' size.
    """
    height, width = hole.shape
    total = len(pixels)
    # In the order in which the next pixel in that direction, if a hole, comes first.
    downwards = step_y < 0 or (step_y == 0 and step_x < 0)
    for n in range(total):
        i = n if downwards else total - 1 - n
        # The neighbour: off the frame, a hole that passes on what it found, or known.
        y, x = pixels[i] // width + step_y, pixels[i] % width + step_x
        known[i, k] = -1
        if not (0 <= x < width and 0 <= y < height):
            continue
        if hole[y, x]:
            known[i, k] = known[number[y, x], k]
            continue
        known[i, k] = y * width + x
