"""A selected surface: found by flooding, changed by the brush, with a feathered edge."""

from __future__ import annotations

import numpy as np

from iibr_core.depth.editing.brush import lower_distances
from iibr_core.depth.editing.bucket import DEPTH_EDGE, Mask, surface_at
from iibr_core.depth.editing.edits import Stroke
from iibr_core.depth.geodesic import spread_distances
from iibr_core.types import FloatImage


def flooded(photo: FloatImage, disparity: FloatImage, stroke: Stroke, extent: tuple[float, float]) -> Mask:
    """Return the pixels (H, W) of the surfaces under all points of a stroke; see `surface_at`."""
    found = [surface_at(photo, disparity, stroke, index, extent) for index in range(len(stroke.points))]
    return np.asarray(np.any(found, axis=0))


def patched(photo: FloatImage, mask: Mask, stroke: Stroke) -> Mask:
    """Return a mask (H, W) after the stroke's patches, in their order. Like brush strokes, they end at contours."""
    for patch in stroke.patches:
        path, distance = Stroke("level", patch.points, patch.radius, 1.0), np.ones(mask.shape, np.float32)
        for index in range(len(path.points)):
            lower_distances(photo, path, index, distance)
        mask = mask & (distance == 1) if patch.erases else mask | (distance < 1)
    return mask


def feathered(disparity: FloatImage, mask: Mask, stroke: Stroke, extent: tuple[float, float]) -> FloatImage:
    """Return distances (H, W) for `falloff`: 0 on the mask, 1 where the feather ends. It crosses no depth edge."""
    distance = np.where(mask, np.float32(0), np.float32(1))
    if stroke.feather > 0:
        depth = disparity[..., None] / np.float32(DEPTH_EDGE * (extent[1] - extent[0]))
        spread_distances(np.ascontiguousarray(depth), 1 / max(stroke.feather * mask.shape[1], 1.0), distance)
    return distance
