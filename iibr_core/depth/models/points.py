"""Depth and focal length from a map of points that is known but for its distance from the camera, as MoGe gives it.

Source: Wang et al., MoGe, CVPR 2025: a point (x, y, z) is seen at focal * (x, y) / (z + shift).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.types import FloatImage

FAR = 1e5
"""Distance of what has none, such as the sky, in metres or in units of the points."""
MAX_POINTS = 4096
"""Number of points from which focal length and shift are found."""
ROUNDS = 10
"""Number of least-squares solutions, each weighted by the distances that the one before found."""


def depth_of_points(points: FloatImage, beyond: NDArray[np.bool_] | None, scale: float | None) -> DepthEstimate:
    """Return the depth of a map of points (h, w, 3), x right, y down, z forward.

    beyond: (h, w), True where nothing has a distance; None: nowhere. scale: metres for a unit of the points, None if
    that is not known; the depth is inverse then.
    """
    is_known: NDArray[np.bool_] = np.isfinite(points[..., 2]) & np.isfinite(points[..., 0] + points[..., 1])
    if beyond is not None:
        is_known = is_known & ~beyond
    focal, shift = focal_and_shift(points, is_known)
    z = points[..., 2].astype(np.float32) + np.float32(shift)
    height, width = z.shape
    ratio = focal * np.hypot(height, width) / (2 * width) if focal else None
    is_known = is_known & (z > 0)
    if scale is None:
        inverse = np.divide(np.float32(1), z, out=np.zeros_like(z), where=is_known)
        return DepthEstimate(inverse, "inverse depth", ratio)
    return DepthEstimate(np.where(is_known, z * np.float32(scale), np.float32(FAR)), "metres", ratio)


def focal_and_shift(points: FloatImage, is_known: NDArray[np.bool_]) -> tuple[float | None, float]:
    """Return the focal length in halves of the picture's diagonal, None if it is not found, and the shift of z."""
    height, width = is_known.shape
    rows, columns = np.nonzero(is_known)
    step = max(len(rows) // MAX_POINTS, 1)
    rows, columns = rows[::step], columns[::step]
    if len(rows) < 2:
        return None, 0.0
    diagonal = np.hypot(height, width)
    seen = np.stack([2 * columns + 1 - width, 2 * rows + 1 - height], axis=1) / diagonal
    lateral, z = points[rows, columns, :2].astype(np.float64), points[rows, columns, 2].astype(np.float64)
    focal, shift = None, 0.0
    for _ in range(ROUNDS):
        weight = 1 / np.maximum(z + shift, 1e-3)[:, None]
        unknowns = np.stack([(lateral * weight).ravel(), (-seen * weight).ravel()], axis=1)
        found, _, rank, _ = np.linalg.lstsq(unknowns, (seen * weight * z[:, None]).ravel(), rcond=1e-8)
        if rank < 2 or not np.isfinite(found).all() or found[0] <= 0:
            return None, 0.0
        focal, shift = float(found[0]), float(found[1])
    return focal, shift
