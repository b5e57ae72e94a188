"""Consistency of the inpainted parts of a light field: two views must show the same content behind an object.

This is the paper's claim: content that the photo does not show is made once, for all views.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, maximum_filter, minimum_filter

from iibr_core.method.farthest_views import outer_views
from iibr_core.method.view import View
from iibr_core.surfaces import SAME_SURFACE_PX, step_of
from iibr_core.types import FloatImage, ViewOffset


def consistency(make: Callable[[ViewOffset], View], offsets: Iterable[ViewOffset]) -> float:
    """Return the rms difference, in 1/255, of inpainted content between each outer view and one half-way to it.

    make: makes a view within the box around the offsets. NaN if no two views show the same inpainted content.
    """
    halves = [(at, ViewOffset(at.t / 2, at.s / 2)) for at in outer_views(offsets)]
    squares = [np.square(disagreement(make(at), make(half), at, half)).ravel() for at, half in halves]
    values = np.concatenate(squares) if squares else np.empty(0)
    return float(np.sqrt(values.mean())) if values.size else math.nan


def disagreement(one: View, other: View, at: ViewOffset, other_at: ViewOffset) -> NDArray[np.float64]:
    """Return differences (N, 3) in 1/255 of all pixels that are inpainted in both views and show one surface."""
    t, s = other_at.t - at.t, other_at.s - at.s
    tolerance = step_of(SAME_SURFACE_PX, max(abs(t), abs(s)))
    y, x = np.nonzero(_inside_a_hole(one, tolerance))
    d = one.disparity[y, x]
    there = np.stack([y - d * t, x - d * s]).astype(np.float64)
    inside = ((there >= 1) & (there <= np.array(one.disparity.shape)[:, None] - 2)).all(axis=0)
    y, x, d, there = y[inside], x[inside], d[inside], there[:, inside]
    pixel = tuple(np.rint(there).astype(int))
    same = _inside_a_hole(other, tolerance)[pixel] & (np.abs(other.disparity[pixel] - d) < tolerance)
    warped = np.stack([map_coordinates(other.colors[..., c], there[:, same], order=3) for c in range(3)], axis=-1)
    return np.asarray(255 * (warped - one.colors[y[same], x[same]]), np.float64)


def _inside_a_hole(view: View, tolerance: float) -> NDArray[np.bool_]:
    """Return the inpainted pixels (H, W) that border on no other pixels and no depth edge."""
    depth: FloatImage = maximum_filter(view.disparity, 3) - minimum_filter(view.disparity, 3)
    return np.asarray(minimum_filter(view.inpainted, 3) & (depth < tolerance))
