"""Where a light field's surfaces lie in space.

A light field has no metric scale. Lengths count in view steps, so that the eye of view (t, s) stands at (s, t, 0), the
camera's axes being x right, y down, z away. With a focal length of f px, a disparity of d px per view step and
d_inf that of what is infinitely far (0 unless the plane that stays still is another), a point lies at the distance
Z = f / (d - d_inf), and the photo's pixel (x, y) shows ((x - cx) Z / f, (y - cy) Z / f, Z). No other number is needed
for the way that viewing directions change from view to view.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iibr_core.types import Disparity, FloatImage

LEAST_NEARNESS = 1e-3
"""Of the nearest: nothing is farther than so many times its distance, the inverse of this."""


@dataclass(frozen=True)
class SceneGeometry:
    """focal_px: of the photo, px. infinity: disparity of what is infinitely far, px per view step."""

    focal_px: float
    infinity: float

    def nearness(self, disparity: FloatImage) -> FloatImage:
        """Disparity (any shape) above that of infinity, px per view step: f / Z, at least a share of the nearest."""
        above = disparity - np.float32(self.infinity)
        nearest = float(above.max(initial=0.0))
        return np.asarray(np.maximum(above, max(LEAST_NEARNESS * nearest, 1e-6)), np.float32)

    def points(self, disparity: FloatImage) -> FloatImage:
        """Points (H, W, 3), in view steps, that a photo of this disparity (H, W) shows."""
        height, width = disparity.shape
        y, x = np.mgrid[:height, :width].astype(np.float32)
        ray = np.stack([x - (width - 1) / 2, y - (height - 1) / 2, np.full_like(x, self.focal_px)], axis=-1)
        return np.asarray(ray / self.nearness(disparity)[..., None], np.float32)


def infinity_of(given: Disparity) -> float:
    """The disparity, as given, of what is infinitely far: known with metres; else 0 as long as nothing lies beyond,
    else as far beyond the farthest as the nearest lies before it, which is then half as far away.
    """
    if given.inverse_metres is not None and given.inverse_metres[0] != 0:
        slope, offset = given.inverse_metres
        return -offset / slope
    low, high = float(given.values.min()), float(given.values.max())
    return 0.0 if low >= 0 else low - (high - low)
