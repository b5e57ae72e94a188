"""The nearest known pixel around a hole pixel, in each of sixteen directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces

DIRECTIONS = np.array(
    [
        (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1),
        (2, 1), (-2, 1), (2, -1), (-2, -1), (1, 2), (-1, 2), (1, -2), (-1, -2),
    ]
)  # fmt: skip
"""Steps (right, down)."""
LINES = 4
"""Number of lines through a pixel, whose two directions come first in DIRECTIONS."""
MAX_HOLE_PIXELS_AT_ONCE = 1 << 15
"""Largest number of hole pixels that are filled between two checks for cancellation."""


class AroundHoles(NamedTuple):
    """Hole pixels and the known pixels around them.

    pixels (N,): flat indices of the hole pixels, ascending. number (H, W): index of each hole pixel in `pixels`.
    known (N, D): flat index of the nearest known pixel in each direction, -1 without one.
    """

    pixels: NDArray[np.int64]
    number: NDArray[np.int32]
    known: NDArray[np.int32]


def nearest_known(hole: NDArray[np.bool_], threads: int, directions: int = len(DIRECTIONS)) -> AroundHoles:
    """Return the pixels of holes (H, W) and the nearest known pixels in the first directions of DIRECTIONS."""
    pixels, number = np.flatnonzero(hole), np.empty(hole.shape, np.int32)
    number_pixels(pixels, number)
    known = np.empty((len(pixels), directions), np.int32)
    in_pieces(
        lambda k: _nearest_known_towards(hole, pixels, number, *DIRECTIONS[k], known, k), range(directions), threads
    )
    return AroundHoles(pixels, number, known)


def number_pixels(pixels: NDArray[np.int64], number: NDArray[np.int32]) -> None:
    """Write to number (H, W), at each of these pixels (N,), flat indices, its index among them."""
    np.put(number, pixels, np.arange(len(pixels)))


@kernel
def _nearest_known_towards(hole, pixels, number, step_x, step_y, known, k):
    """Write column k of `known`, for the direction (step_x, step_y).

    A hole pixel takes over what the next pixel in that direction found, so the time does not depend on the size of the
    holes. The column is no argument of its own because its layout would differ where N is 1.
    """
    height, width = hole.shape
    total = len(pixels)
    # The next pixel in that direction has to come first.
    downwards = step_y < 0 or (step_y == 0 and step_x < 0)
    for n in range(total):
        i = n if downwards else total - 1 - n
        y, x = pixels[i] // width + step_y, pixels[i] % width + step_x
        known[i, k] = -1
        if not (0 <= x < width and 0 <= y < height):
            continue
        if hole[y, x]:
            known[i, k] = known[number[y, x], k]
        else:
            known[i, k] = y * width + x
