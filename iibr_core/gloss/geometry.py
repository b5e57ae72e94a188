"""Positions of a light field's surfaces in space.

A light field has no metric scale. Lengths are in view steps: the eye of view (t, s) stands at (s, t, 0), with x right,
y down, z away. With a focal length of f px and the disparity d_inf of infinitely far points, a disparity of d px per
view step lies at the distance Z = f / (d - d_inf), and the photo's pixel (x, y) shows the point
((x - cx) Z / f, (y - cy) Z / f, Z). Viewing directions depend on no other number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iibr_core.types import FloatImage

MAX_DISTANCE_RATIO = 1000.0
"""Farthest distance as a multiple of the nearest; anything farther, such as the sky, is put there."""


class SceneGeometry(NamedTuple):
    """focal_px: focal length of the photo, px. infinity: disparity of infinitely far points, px per view step."""

    focal_px: float
    infinity: float

    def nearness(self, disparity: FloatImage) -> FloatImage:
        """Return f / Z of disparities (any shape), px per view step, positive."""
        above = disparity - np.float32(self.infinity)
        nearest = float(above.max(initial=0.0))
        return np.asarray(np.maximum(above, max(nearest / MAX_DISTANCE_RATIO, 1e-6)), np.float32)
