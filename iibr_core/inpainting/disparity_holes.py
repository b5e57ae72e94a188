"""Unknown disparity, filled from its background side: a camera's blind spot lies behind the surface beside it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.nearest_known import LINES, MAX_HOLE_PIXELS_AT_ONCE, nearest_known
from iibr_core.runtime import tiling
from iibr_core.runtime.tiling import in_pieces, pieces_of
from iibr_core.types import FloatImage

STEP_LENGTHS = np.array([0.5, 1.0, math.sqrt(2), math.sqrt(2)])
"""Length of a step along the horizontal, the vertical and the two diagonals.

The horizontal counts half, because the cameras of a stereo rig stand side by side: blind spots end left and right.
"""
OPEN_LINE = 12
"""Factor on the length of a line that reaches the frame before a known value."""
SHORTNESS = 8
"""Exponent of the inverse length in the weight of a line; 8 was best of 2, 4, 8 on four scenes."""


def fill_disparity_holes(values: FloatImage) -> FloatImage:
    """Replace the NaN of a disparity map (H, W); known values stay.

    On each of four lines through an unknown pixel, the farther (smaller) of the two nearest known values counts; the
    lines are averaged by 1 / length**8, the length being that of the way across the hole. Lines on which the hole
    reaches the frame have one end and count little. All results lie within the known values.
    Raises ValueError if nothing is known.
    """
    filled = np.array(values, np.float32, order="C")
    unknown = np.isnan(filled)
    if not unknown.any():
        return filled
    if unknown.all():
        raise ValueError("no known value to fill from")
    pixels, _, known = nearest_known(unknown, tiling.THREADS, 2 * LINES)
    parts = pieces_of(len(pixels), MAX_HOLE_PIXELS_AT_ONCE)
    means = in_pieces(lambda part: _farther_sides(filled, pixels[part], known[part]), parts, tiling.THREADS)
    np.put(filled, pixels, np.concatenate(means))
    # Pixels without a known value on any line are still unknown.
    return fill_disparity_holes(filled)


def _farther_sides(values: FloatImage, pixels: NDArray[np.int64], known: NDArray[np.int32]) -> FloatImage:
    """Return disparities (N,) for pixels (N,) from the known pixels (N, 8) at the ends of their lines."""
    is_known = known >= 0
    (y, x), (known_y, known_x) = np.divmod(pixels[:, None], values.shape[1]), np.divmod(known, values.shape[1])
    steps = np.where(is_known, np.maximum(abs(known_y - y), abs(known_x - x)), 0)
    ends = np.where(is_known, np.take(values, known), np.float32(np.nan))
    farther = np.fmin(ends[:, ::2], ends[:, 1::2])
    is_open = ~(is_known[:, ::2] & is_known[:, 1::2])
    lengths = STEP_LENGTHS * (steps[:, ::2] + steps[:, 1::2]) * np.where(is_open, OPEN_LINE, 1)
    lengths[np.isnan(farther)] = np.inf
    # Relative to the shortest, so that no power overflows; NaN without any line.
    with np.errstate(invalid="ignore"):
        weights = (lengths.min(axis=1, keepdims=True) / lengths) ** SHORTNESS
        return np.asarray((weights * np.nan_to_num(farther)).sum(axis=1) / weights.sum(axis=1), np.float32)


def say_filled(name: str, unknown: float) -> str:
    """Return a sentence about a map of which this share, above 0, was filled."""
    if unknown > 0.9:
        return f"Only {100 * (1 - unknown):.2g} % of {name} is known; what is unknown was filled from around it."
    return f"{100 * unknown:.2g} % of {name} is unknown and was filled from around it."
