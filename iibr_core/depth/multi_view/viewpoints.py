"""Viewpoints of a light field's views, measured from their parallax.

Points of the reference view are found again in other views. A point of disparity d moves by -d * (s, t) in the view at
(t, s): the shifts of all points in all views are products of one number a point and one direction a view. Such factors
are found up to a common factor, of either sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.guess import box_filter
from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces
from iibr_core.types import FloatImage

LONGEST_PX = 256
"""Longer side of the small views in which points are looked for, about."""
CELLS = 9, 12
"""Rows and columns of cells of the reference, in each of which one point is chosen."""
PATCH_RADIUS_PX = 3
LIGHT_SHARE, MIN_LIGHT = 1 / 6, 0.02
"""Radius of the squares whose mean is made alike, as a share of the longer side, and the luma added to it."""
SEARCH_SHARE = 0.09
"""Largest shift that is looked for first, as a share of the longer side."""
MIN_CORNER = 5e-5
"""Smallest gradient across the weaker direction (mean square of luma a pixel) of a point that can be found again."""
MAX_SECOND = 0.7
"""Largest ratio of the least difference to that of another place, for a place that is found without doubt."""
MAX_PATCH_DIFFERENCE = 0.06
"""Largest root mean square difference of a patch and its place in another view."""
MIN_SHIFT_PX, MIN_MOVING = 0.1, 0.05
"""Least shift of a point that moves, and the smallest share of such points where views have any parallax."""
MIN_POINTS = 8
"""Fewest points by which a viewpoint counts as measured."""
MIN_AGREEING = 0.5
"""Smallest share of a view's points that must agree with its viewpoint."""
TOLERANCE_PX = 0.35
"""Distance of an agreeing point from its predicted place, beside TOLERANCE_SHARE of its shift."""
TOLERANCE_SHARE = 0.1
BASES = 3
"""Number of views from which the factors are looked for."""
ROUNDS = 12
REFINEMENTS = 5
"""Number of steps in which a shift is refined."""

Doubles = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Viewpoints:
    """Measured viewpoints. offsets: (N, 2), (t, s) from the reference, up to a common factor of either sign; NaN where
    a view could not be measured. agreeing: share (N,) of the points that agree with each.
    """

    offsets: Doubles
    agreeing: Doubles

    @property
    def is_measured(self) -> NDArray[np.bool_]:
        """Which views (N,) are measured."""
        return np.isfinite(self.offsets[:, 0])


def measure_viewpoints(
    reference: FloatImage, others: Sequence[FloatImage], search_share: float = SEARCH_SHARE
) -> Viewpoints:
    """Return the viewpoints of views (H, W), luma of 0 .. 1, that are alike in size."""
    reference, *others = map(_smooth, (reference, *others))
    reach, light = max(round(search_share * max(reference.shape)), 2), _light(reference)
    points = find_corners(reference)
    unique = np.empty(len(points), np.bool_)
    _are_unique(reference, points, reach, unique)
    points = points[unique]
    if len(points) < MIN_POINTS:
        return Viewpoints(np.full((len(others), 2), np.nan), np.zeros(len(others)))

    def find(other: FloatImage) -> Doubles:
        found = np.empty((len(points), 2))
        _find_points(reference, _in_same_light(other, light), points, reach, found)
        return found

    return factorise(np.stack(in_pieces(find, others, tiling.THREADS)))


def _smooth(luma: FloatImage) -> FloatImage:
    """Return a luma with each pixel's neighbours mixed in: patches that lie between pixels then match, too."""
    for _ in range(2):
        padded = np.pad(luma, ((1, 1), (0, 0)), "edge")
        luma = np.ascontiguousarray((padded[:-2] + 2 * luma + padded[2:]).T / np.float32(4))
    return luma


def _in_same_light(luma: FloatImage, light: FloatImage) -> FloatImage:
    """Return a luma as bright around each pixel as `light`: exposure and vignetting differ from view to view."""
    return (luma * ((light + MIN_LIGHT) / (_light(luma) + MIN_LIGHT))).astype(np.float32)


def _light(luma: FloatImage) -> FloatImage:
    """Return the mean (H, W) around each pixel."""
    radius = round(LIGHT_SHARE * max(luma.shape))
    return box_filter(np.pad(luma, radius, "edge"), radius)[radius:-radius, radius:-radius]


def find_corners(luma: FloatImage) -> NDArray[np.int64]:
    """Return places (P, 2), row and column, of points that differ from their neighbours in every direction."""
    down, across = (np.asarray(slope, np.float32) for slope in np.gradient(luma))
    radius = PATCH_RADIUS_PX
    tt, ss, ts = (box_filter(product, radius) for product in (down * down, across * across, down * across))
    weaker = (tt + ss) / 2 - np.sqrt(((tt - ss) / 2) ** 2 + ts**2)
    rows, columns = (
        np.linspace(radius + 1, length - radius - 1, cells + 1).astype(int) for length, cells in zip(luma.shape, CELLS)
    )
    found = []
    for (top, bottom), (left, right) in product(pairwise(rows), pairwise(columns)):
        cell = weaker[top:bottom, left:right]
        if cell.size and cell.max() >= MIN_CORNER:
            y, x = np.unravel_index(cell.argmax(), cell.shape)
            found.append((top + int(y), left + int(x)))
    return np.array(found, np.int64).reshape(-1, 2)


@kernel
def _find_points(reference, other, points, reach, found):
    """Fill found with the shift (down, across) of each point, to a part of a pixel; NaN where it is in doubt."""
    radius = PATCH_RADIUS_PX
    side = 2 * radius + 1
    worst, outside = np.float32(side**2 * MAX_PATCH_DIFFERENCE**2), np.float32(side**2)
    costs = np.empty((2 * reach + 1, 2 * reach + 1), np.float32)
    for k in range(len(points)):
        top, left = points[k, 0] - radius, points[k, 1] - radius
        found[k] = np.nan
        _fill_costs(reference, other, top, left, reach, worst, costs)
        best, best_y, best_x = outside, 0, 0
        for row in range(2 * reach + 1):
            for column in range(2 * reach + 1):
                if costs[row, column] < best:
                    best, best_y, best_x = costs[row, column], row, column
        if not (best <= worst and 0 < best_y < 2 * reach and 0 < best_x < 2 * reach):
            continue
        if best <= np.float32(MAX_SECOND) * _least_beside(costs, best_y, best_x):
            t, s = _refine_shift(reference, other, top, left, best_y - reach, best_x - reach)
            found[k, 0], found[k, 1] = t, s


@kernel
def _are_unique(luma, points, reach, unique):
    """Fill `unique` with whether each point's patch resembles no other place as much as one a pixel beside it.

    Places of a pattern that repeats, and of an edge, along which a patch slides, are not unique.
    """
    radius = PATCH_RADIUS_PX
    costs = np.empty((2 * reach + 1, 2 * reach + 1), np.float32)
    for k in range(len(points)):
        top, left = points[k, 0] - radius, points[k, 1] - radius
        _fill_costs(luma, luma, top, left, reach, np.float32((2 * radius + 1) ** 2), costs)
        beside = costs[reach - 1, reach] + costs[reach + 1, reach] + costs[reach, reach - 1] + costs[reach, reach + 1]
        unique[k] = _least_beside(costs, reach, reach) > beside / 4


@kernel
def _fill_costs(reference, other, top, left, reach, worst, costs):
    """Fill `costs` with the squared difference of a patch and each place around it; sums stop above `worst`."""
    side, (height, width) = 2 * PATCH_RADIUS_PX + 1, reference.shape
    costs[:] = np.float32(side**2)
    for y in range(max(top - reach, 0), min(top + reach, height - side) + 1):
        for x in range(max(left - reach, 0), min(left + reach, width - side) + 1):
            cost = np.float32(0)
            for row in range(side):
                for column in range(side):
                    difference = reference[top + row, left + column] - other[y + row, x + column]
                    cost += difference * difference
                if cost > worst:
                    break
            costs[y - top + reach, x - left + reach] = cost


@kernel
def _least_beside(costs, y, x):
    """Return the least cost more than a pixel away from a place."""
    least = np.float32((2 * PATCH_RADIUS_PX + 1) ** 2)
    for row in range(costs.shape[0]):
        for column in range(costs.shape[1]):
            if abs(row - y) > 1 or abs(column - x) > 1:
                least = min(least, costs[row, column])
    return least


@kernel
def _refine_shift(reference, other, top, left, t, s):
    """Return the shift of a patch to a part of a pixel, by Gauss-Newton steps from whole pixels; NaN if it strays."""
    side, (height, width) = 2 * PATCH_RADIUS_PX + 1, reference.shape
    start_t, start_s, t, s = t, s, np.float64(t), np.float64(s)
    for _ in range(REFINEMENTS):
        y, x = top + t, left + s
        if max(abs(t - start_t), abs(s - start_s)) > 1 or min(y, x) < 0 or y >= height - side or x >= width - side:
            return np.nan, np.nan
        row_0, column_0 = int(y), int(x)
        b, a = np.float32(y - row_0), np.float32(x - column_0)
        tt = ts = ss = t_error = s_error = np.float32(1e-12)
        for row in range(side):
            for column in range(side):
                r, c, i, j = top + row, left + column, row_0 + row, column_0 + column
                upper = other[i, j] * (1 - a) + other[i, j + 1] * a
                lower = other[i + 1, j] * (1 - a) + other[i + 1, j + 1] * a
                error = upper * (1 - b) + lower * b - reference[r, c]
                down = (reference[r + 1, c] - reference[r - 1, c]) / 2
                across = (reference[r, c + 1] - reference[r, c - 1]) / 2
                tt += down * down
                ts += down * across
                ss += across * across
                t_error += down * error
                s_error += across * error
        scale = 1 / (tt * ss - ts * ts)
        t -= scale * (ss * t_error - ts * s_error)
        s -= scale * (tt * s_error - ts * t_error)
    return t, s


def factorise(shifts: Doubles) -> Viewpoints:
    """Return the viewpoints (N, 2) of shifts (N, P, 2), down and across, of P points in N views; NaN: not found."""
    is_found = np.isfinite(shifts[..., 0])
    best = Viewpoints(np.full((len(shifts), 2), np.nan), np.zeros(len(shifts)))
    if not (np.abs(shifts[is_found]) > MIN_SHIFT_PX).any(axis=-1).mean() >= MIN_MOVING:
        return best
    for base in np.argsort(-is_found.sum(axis=1))[:BASES]:
        disparity = _along(shifts[base])
        if np.isfinite(disparity).sum() < MIN_POINTS:
            continue
        found = _refine(shifts, is_found, disparity)
        if np.nansum(found.agreeing) > np.nansum(best.agreeing):
            best = found
    return best


def _along(shifts: Doubles) -> Doubles:
    """Return how far (P,) points moved along the direction in which most of them moved; NaN for those that did not."""
    across_down = shifts[:, 1] + 1j * shifts[:, 0]
    known = across_down[np.isfinite(across_down)]
    direction = np.exp(0.5j * np.angle((known**2 / np.maximum(np.abs(known), 1e-9)).sum()))
    turned = across_down / direction
    agrees = np.abs(turned.imag) < TOLERANCE_PX + TOLERANCE_SHARE * np.abs(turned.real)
    return np.where(agrees, turned.real, np.nan)


def _refine(shifts: Doubles, is_found: NDArray[np.bool_], disparity: Doubles) -> Viewpoints:
    """Return the viewpoints that agree best with shifts, from a first guess of the disparity (P,) of their points."""
    shifts, offsets = np.where(is_found[..., None], shifts, 0.0), np.zeros((len(shifts), 2))
    weights = (is_found & np.isfinite(disparity)).astype(float)
    disparity = np.nan_to_num(disparity)
    for _ in range(ROUNDS):
        # Shifts are -d * offset.
        power = (weights * disparity**2).sum(axis=1)
        offsets = -((weights * disparity)[..., None] * shifts).sum(axis=1) / np.maximum(power, 1e-9)[:, None]
        power = (is_found * weights * (offsets**2).sum(axis=1)[:, None]).sum(axis=0)
        along = -(weights * np.einsum("npi,ni->np", shifts, offsets)).sum(axis=0)
        disparity = along / np.maximum(power, 1e-9)
        away = np.linalg.norm(shifts + disparity[:, None] * offsets[:, None], axis=-1)
        tolerance = TOLERANCE_PX + TOLERANCE_SHARE * np.linalg.norm(shifts, axis=-1)
        weights = is_found / (1 + (away / tolerance) ** 2) ** 2
    agreeing = ((away < tolerance) & is_found).sum(axis=1) / np.maximum(is_found.sum(axis=1), 1)
    is_measured = (is_found.sum(axis=1) >= MIN_POINTS) & (agreeing >= MIN_AGREEING)
    return Viewpoints(np.where(is_measured[:, None], offsets, np.nan), np.where(is_measured, agreeing, 0.0))
