"""Selection of the glossy pixels by depth, colour and brush strokes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.gloss.settings import GlossStroke, GlossSurface
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage

SOFT_DEPTH, SOFT_COLOR = 0.02, 0.05
"""Widths over which the surface fades beyond its limits, in shares of the range of depth and in units of colour."""


def surface_mask(surface: GlossSurface, photo: FloatImage, disparity: FloatImage) -> FloatImage:
    """Return how far each pixel (H, W) belongs to the surface, 0..1.

    photo: (H, W, 3), sRGB-encoded. disparity: (H, W).
    """
    if surface.strokes_only:
        mask = np.zeros(disparity.shape, np.float32)
    else:
        mask = _depth_mask(surface, disparity)
        if surface.color is not None:
            distance = np.linalg.norm(photo - np.array(surface.color, np.float32), axis=2)
            mask *= np.clip(1 + (np.float32(surface.tolerance) - distance) / np.float32(SOFT_COLOR), 0, 1)
    for stroke in surface.strokes:
        raise_if_stopped()
        np.putmask(mask, _stroke_pixels(stroke, mask), np.float32(not stroke.erases))
    return mask


def _depth_mask(surface: GlossSurface, disparity: FloatImage) -> FloatImage:
    low, high = float(disparity.min()), float(disparity.max())
    if high <= low:
        return np.ones(disparity.shape, np.float32)
    share = (disparity - np.float32(low)) / np.float32(high - low)
    inside = np.minimum(share - np.float32(surface.farthest), np.float32(surface.nearest) - share)
    return np.asarray(np.clip(1 + inside / np.float32(SOFT_DEPTH), 0, 1), np.float32)


def _stroke_pixels(stroke: GlossStroke, mask: FloatImage) -> NDArray[np.bool_]:
    """Return the pixels (H, W) within the stroke's radius of its path."""
    height, width = mask.shape
    pixels = np.zeros(mask.shape, np.bool_)
    path = np.array(stroke.points, np.float64) * (width, height) - 0.5
    radius = max(stroke.radius * width, 0.5)
    for start, end in zip(path, path[1:] if len(path) > 1 else path):
        corners = np.floor((np.minimum(start, end) - radius, np.maximum(start, end) + radius + 1))
        (left, top), (right, bottom) = np.clip(corners, 0, (width, height)).astype(int)
        y, x = np.mgrid[top:bottom, left:right]
        along = end - start
        share = ((x - start[0]) * along[0] + (y - start[1]) * along[1]) / max(float(along @ along), 1e-12)
        share = np.clip(share, 0, 1)
        distance = np.hypot(x - start[0] - share * along[0], y - start[1] - share * along[1])
        pixels[top:bottom, left:right] |= distance <= radius
    return pixels
