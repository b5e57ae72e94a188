"""Openness of the lens at a point of its aperture: disc, polygon, ring, or a grey image, with antialiased edges.

Plain arrays, no GL. The cat's-eye is a disc here: the lens barrel, which cuts it off, depends on the pixel.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import ApertureMask, ApertureShape

Doubles = NDArray[np.float64]


def openness(shape: ApertureShape, t: Doubles, s: Doubles, diameter: float, widest: float, width: float) -> Doubles:
    """Return `opening`, cut off to a square `widest` across."""
    within = 0.5 + (widest / 2 - np.maximum(np.abs(t), np.abs(s))) / width
    return np.minimum(opening(shape, t, s, diameter, width), np.clip(within, 0, 1))


def reach_of(shape: ApertureShape, cut: float = 1.0) -> float:
    """Return the diameter of the circle around an opening of diameter 1, cut off to a square `cut` across; it includes
    a mask's corners.
    """
    return math.sqrt(2) * min(cut, 1.0) if shape.kind == "mask" else min(math.sqrt(2) * cut, 1.0)


def opening(shape: ApertureShape, t: Doubles, s: Doubles, diameter: float, width: float) -> Doubles:
    """Return the share 0..1 of each sample that passes the opening.

    t, s: positions from the middle, in view steps. diameter: that of the circle around the opening. width: side of the
    square that a sample stands for, in view steps; edges are as wide.
    """
    if shape.kind == "mask" and shape.mask is not None:
        cos, sin = math.cos(math.radians(shape.rotation_deg)), math.sin(math.radians(shape.rotation_deg))
        return _mean_of_mask(shape.mask, t * cos - s * sin, s * cos + t * sin, diameter, width)
    return np.clip(0.5 + _edge_distance(shape, t, s, diameter / 2) / width, 0.0, 1.0)


def _edge_distance(shape: ApertureShape, t: Doubles, s: Doubles, radius: float) -> Doubles:
    """Return the distance to the opening's edge, positive inside."""
    if shape.kind == "polygon":
        half = math.pi / shape.blades
        angles = math.radians(shape.rotation_deg) + (2 * np.arange(shape.blades) + 1) * half  # a corner is on top
        outward = np.multiply.outer(s, np.sin(angles)) - np.multiply.outer(t, np.cos(angles))
        straight, round_share = radius * math.cos(half) - outward.max(-1), shape.roundness
        return np.asarray((1 - round_share) * straight + round_share * (radius - np.hypot(t, s)))
    distance = np.hypot(t, s)
    if shape.kind == "ring":
        return np.minimum(radius - distance, distance - radius * shape.ring_inner)
    return radius - distance


def _mean_of_mask(mask: ApertureMask, t: Doubles, s: Doubles, diameter: float, width: float) -> Doubles:
    """Return the mean of the mask over each sample's square; its longer side is as long as the diameter."""
    # A summed-area table gives the mean over each square from four corners.
    pixel = diameter / max(mask.rows, mask.columns)
    top, left = (t - width / 2) / pixel + mask.rows / 2, (s - width / 2) / pixel + mask.columns / 2
    bottom, right = top + width / pixel, left + width / pixel
    sums = _summed_area(mask)
    corners = ((bottom, right, 1), (top, left, 1), (top, right, -1), (bottom, left, -1))
    return np.clip(sum(sign * _bilinear(sums, y, x) for y, x, sign in corners) * (pixel / width) ** 2, 0.0, 1.0)


@lru_cache(maxsize=4)
def _summed_area(mask: ApertureMask) -> Doubles:
    """Return the sums (rows + 1, columns + 1) of all pixels above and left of each pixel corner."""
    image = np.frombuffer(mask.values, np.uint8).reshape(mask.rows, mask.columns) / 255.0
    return np.pad(image.cumsum(0).cumsum(1), ((1, 0), (1, 0)))


def _bilinear(table: Doubles, y: Doubles, x: Doubles) -> Doubles:
    """Return the values at these positions; the border is repeated."""
    y, x = np.clip(y, 0, table.shape[0] - 1), np.clip(x, 0, table.shape[1] - 1)
    row, column = np.minimum(y.astype(int), table.shape[0] - 2), np.minimum(x.astype(int), table.shape[1] - 2)
    y, x = y - row, x - column
    upper = table[row, column] * (1 - x) + table[row, column + 1] * x
    lower = table[row + 1, column] * (1 - x) + table[row + 1, column + 1] * x
    return np.asarray(upper * (1 - y) + lower * y)
