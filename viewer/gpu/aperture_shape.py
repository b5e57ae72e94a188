"""How open the lens is at a point of its aperture: disc, polygon, ring, or a grey image, their edges antialiased.

Plain arrays, no GL. The cat's-eye is a disc here: the lens barrel, which cuts it off, depends on the pixel.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewer.state import ApertureMask, ApertureShape

MASK_POINTS = 8
"""Of a sample's own area of the mask, across: its opening is their mean."""


def opening(
    shape: ApertureShape, t: NDArray[np.float64], s: NDArray[np.float64], diameter: float, width: float
) -> NDArray[np.float64]:
    """Share of each sample that passes, 0..1. t, s: places from the middle, view steps.

    diameter: of the circle around the opening. width: what a sample stands for, view steps; edges are as wide.
    """
    if shape.kind == "mask" and shape.mask is not None:
        t, s = _turned(t, s, -shape.rotation_deg)
        return _mean_of_mask(shape.mask, t, s, diameter, width)
    return np.clip(0.5 + _inside_by(shape, t, s, diameter / 2) / width, 0.0, 1.0)


def _inside_by(
    shape: ApertureShape, t: NDArray[np.float64], s: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """Distance to the opening's edge, positive inside."""
    if shape.kind == "polygon":
        half = math.pi / shape.blades
        angles = math.radians(shape.rotation_deg) + (2 * np.arange(shape.blades) + 1) * half  # a corner is on top
        outward = np.multiply.outer(s, np.sin(angles)) - np.multiply.outer(t, np.cos(angles))
        return radius * math.cos(half) - outward.max(-1)
    inside_by = radius - np.hypot(t, s)
    if shape.kind == "ring":
        return np.minimum(inside_by, np.hypot(t, s) - radius * shape.ring_inner)
    return inside_by


def _turned(
    t: NDArray[np.float64], s: NDArray[np.float64], degrees: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Clockwise as seen, t down."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return t * cos + s * sin, s * cos - t * sin


def _mean_of_mask(
    mask: ApertureMask, t: NDArray[np.float64], s: NDArray[np.float64], diameter: float, width: float
) -> NDArray[np.float64]:
    """The mask lies in the middle, its longer side as long as the diameter."""
    image = np.frombuffer(mask.values, np.uint8).reshape(mask.rows, mask.columns) / 255.0
    pixel = diameter / max(mask.rows, mask.columns)
    within = ((np.arange(MASK_POINTS) + 0.5) / MASK_POINTS - 0.5) * width
    y = np.floor((t[..., None, None] + within[:, None]) / pixel + mask.rows / 2).astype(int)
    x = np.floor((s[..., None, None] + within[None, :]) / pixel + mask.columns / 2).astype(int)
    is_on_it = (y >= 0) & (y < mask.rows) & (x >= 0) & (x < mask.columns)
    values = image[np.clip(y, 0, mask.rows - 1), np.clip(x, 0, mask.columns - 1)]
    return np.where(is_on_it, values, 0.0).mean((-2, -1))
