"""Light slab -> Pluecker: rays as lines in space (paper, section 3.1), also those of cameras off the plane.

World axes: x right, y down, z away from the cameras, in pixels of the plane z = 1, where disparity is 0. View (t, s)
stands at (s, t) * VIEW_STEP_PX on the plane z = 0 and sees the world point (X, Y, 1) at pixel (X, Y): a light slab.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iibr_core.types import ViewOffset

VIEW_STEP_PX = 64.0
"""Distance of neighbouring views. The field does not depend on it, only depths do: z = step / (step + disparity)."""

Lines = NDArray[np.float64]
"""(N, 6) Pluecker coordinates: direction d (unit length) and moment m = point x d, with d . m = 0."""


def line_of(point: ArrayLike, direction: ArrayLike) -> Lines:
    """The lines through points (N, 3) along directions (N, 3). Raises ValueError for a direction without length, or
    one that is not finite.
    """
    d = np.asarray(direction, np.float64)
    length = np.linalg.norm(d, axis=-1, keepdims=True)
    if not ((length > 0) & (length < np.inf)).all():
        raise ValueError("a direction has no length, or an infinite one")
    d = d / length
    return np.concatenate([d, np.cross(np.asarray(point, np.float64), d)], axis=-1)


def line_of_pixel(x: ArrayLike, y: ArrayLike, offset: ViewOffset) -> Lines:
    """The rays (N, 6) of the view at an offset through pixels (x, y), each (N,)."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    eye = np.array([offset.s, offset.t, 0.0]) * VIEW_STEP_PX
    towards = np.stack([x - eye[0], y - eye[1], np.ones_like(x)], axis=-1)
    return line_of(np.broadcast_to(eye, towards.shape), towards)
