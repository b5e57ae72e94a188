"""How open the lens is at a point of its aperture: disc, polygon, ring, or a grey image, their edges antialiased.

Plain arrays, no GL. The cat's-eye is a disc here: the lens barrel, which cuts it off, depends on the pixel.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import ApertureMask, ApertureShape


def opening(
    shape: ApertureShape, t: NDArray[np.float64], s: NDArray[np.float64], diameter: float, width: float
) -> NDArray[np.float64]:
    """Share of each sample that passes, 0..1. t, s: places from the middle, view steps.

    diameter: of the circle around the opening. width: what a sample stands for, view steps; edges are as wide.
    """
    if shape.kind == "mask" and shape.mask is not None:
        t, s = _rotate(t, s, -shape.rotation_deg)
        return _mean_of_mask(shape.mask, t, s, diameter, width)
    return np.clip(0.5 + _inside_by(shape, t, s, diameter / 2) / width, 0.0, 1.0)


def _inside_by(
    shape: ApertureShape, t: NDArray[np.float64], s: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """Distance to the opening's edge, positive inside."""
    if shape.kind == "polygon":
        # Distance to the nearest of its sides.
        half = math.pi / shape.blades
        angles = math.radians(shape.rotation_deg) + (2 * np.arange(shape.blades) + 1) * half  # a corner is on top
        outward = np.multiply.outer(s, np.sin(angles)) - np.multiply.outer(t, np.cos(angles))
        return np.asarray(radius * math.cos(half) - outward.max(-1))
    inside_by = radius - np.hypot(t, s)
    if shape.kind == "ring":
        return np.minimum(inside_by, np.hypot(t, s) - radius * shape.ring_inner)
    return inside_by


def _rotate(
    t: NDArray[np.float64], s: NDArray[np.float64], degrees: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Clockwise as seen, t down."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return t * cos + s * sin, s * cos - t * sin


def _mean_of_mask(
    mask: ApertureMask, t: NDArray[np.float64], s: NDArray[np.float64], diameter: float, width: float
) -> NDArray[np.float64]:
    """Over each sample's square. The mask lies in the middle, its longer side as long as the diameter."""
    # A summed-area table gives the mean over each square from four corners.
    pixel = diameter / max(mask.rows, mask.columns)
    top, left = (t - width / 2) / pixel + mask.rows / 2, (s - width / 2) / pixel + mask.columns / 2
    bottom, right = top + width / pixel, left + width / pixel
    sums = _sums_of(mask)
    corners = ((bottom, right, 1), (top, left, 1), (top, right, -1), (bottom, left, -1))
    return np.clip(sum(sign * _between(sums, y, x) for y, x, sign in corners) * (pixel / width) ** 2, 0.0, 1.0)


@lru_cache(maxsize=4)
def _sums_of(mask: ApertureMask) -> NDArray[np.float64]:
    """(rows + 1, columns + 1): of all pixels above and left of each pixel corner."""
    image = np.frombuffer(mask.values, np.uint8).reshape(mask.rows, mask.columns) / 255.0
    return np.pad(image.cumsum(0).cumsum(1), ((1, 0), (1, 0)))


def _between(table: NDArray[np.float64], y: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bilinear; beyond the border it stays as there."""
    y, x = np.clip(y, 0, table.shape[0] - 1), np.clip(x, 0, table.shape[1] - 1)
    row, column = np.minimum(y.astype(int), table.shape[0] - 2), np.minimum(x.astype(int), table.shape[1] - 2)
    y, x = y - row, x - column
    upper = table[row, column] * (1 - x) + table[row, column + 1] * x
    lower = table[row + 1, column] * (1 - x) + table[row + 1, column + 1] * x
    return np.asarray(upper * (1 - y) + lower * y)


def openness(
    shape: ApertureShape,
    t: NDArray[np.float64],
    s: NDArray[np.float64],
    diameter: float,
    widest: float,
    width: float,
) -> NDArray[np.float64]:
    """Share of each sample that passes the opening, cut off to a square `widest` across. See `opening`."""
    within = 0.5 + (widest / 2 - np.maximum(np.abs(t), np.abs(s))) / width
    return np.minimum(opening(shape, t, s, diameter, width), np.clip(within, 0, 1))
