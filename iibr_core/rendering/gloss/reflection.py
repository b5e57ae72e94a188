"""Where what a photo shows reflected is seen in other views.

A reflection is seen as an image behind or before its surface. On the EPI it does not follow the surface's line, so the
position of its source ray is distorted before it is looked up: that of a plane lies as far as what it reflects, that of
a sphere half its radius behind it. To first order, both follow from how the reflected direction turns as the place on
the surface moves (its curvature) and as the eye moves.
"""

from __future__ import annotations

import numpy as np

from iibr_core.rendering.gloss.geometry import SceneGeometry
from iibr_core.types import FloatImage

MOST_TURN = 3.0
"""A reflection runs over its surface at most so many times as fast as one in a plane: beyond, it is a caustic."""
FLATTEST = 0.05
"""Of the turn that a plane's reflection has over a pixel: what turns less, in any direction, counts as turning so."""


def reflection_disparity(disparity: FloatImage, normals: FloatImage, geometry: SceneGeometry) -> FloatImage:
    """Virtual disparity (H, W, 2, 2), px per view step, of what is reflected at each pixel: what is reflected there in
    the photo is seen at (x, y) - M (s, t) in view (t, s). M is `disparity` itself for what is painted on the surface.

    disparity: (H, W); normals: (H, W, 3). What is reflected counts as infinitely far.
    """
    points = geometry.points(disparity)
    here = _reflected(points, normals, np.zeros(3, np.float32))
    turn = np.stack([_across(here), _down(here)], axis=-1)  # (H, W, 3, 2): per pixel
    by_eye = np.stack(
        [_reflected(points, normals, np.array(step, np.float32)) - here for step in ((1, 0, 0), (0, 1, 0))], axis=-1
    )  # per view step
    # least squares of turn . moved = -by_eye
    normal_matrix = np.swapaxes(turn, -1, -2) @ turn
    near = geometry.nearness(disparity)
    least = (FLATTEST / geometry.focal_px) ** 2
    normal_matrix[..., 0, 0] += least
    normal_matrix[..., 1, 1] += least
    moved = -np.linalg.solve(normal_matrix, np.swapaxes(turn, -1, -2) @ by_eye)
    speed = np.sqrt((moved**2).sum(axis=(-1, -2), keepdims=True))
    moved *= np.minimum(1, MOST_TURN * near[..., None, None] / np.maximum(speed, 1e-12))
    own = disparity[..., None, None] * np.eye(2, dtype=np.float32)
    return np.asarray(own - moved, np.float32)


def _reflected(points: FloatImage, normals: FloatImage, eye: FloatImage) -> FloatImage:
    """Unit directions (H, W, 3) from which light comes that is reflected into an eye."""
    away = points - eye
    away /= np.linalg.norm(away, axis=-1, keepdims=True)
    return np.asarray(away - 2 * (away * normals).sum(axis=-1, keepdims=True) * normals, np.float32)


def _across(values: FloatImage) -> FloatImage:
    return np.gradient(values, axis=1) if values.shape[1] > 1 else np.zeros_like(values)


def _down(values: FloatImage) -> FloatImage:
    return np.gradient(values, axis=0) if values.shape[0] > 1 else np.zeros_like(values)
