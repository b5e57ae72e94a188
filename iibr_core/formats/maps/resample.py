"""Disparity maps at another size: exact ones without values between foreground and background, which would fly free
in space, soft ones smoothly, for such values are in them already, and only a smooth ramp tells how soft they are.
"""

from __future__ import annotations

import math

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ImageSize

# Values under one filter footprint that differ by more than this share of the map's range belong to different surfaces.
SURFACE_SHARE = 0.02


STRONG_SHARE = 0.1
"""Smallest step, as a share of the range over four pixels, that counts for the softness of a map."""
REPEATS = (2, 3)
"""How often pixels may be repeated along each axis, and multiples of these."""
LEAST_SIDE = 32
"""No map of a photo has fewer pixels along a side: what repeats is the scene."""
EXACT_SHARE = 0.85
"""An exact map takes at least this much of a step from one pixel to the next, in the middle of its steps."""


def resample_map(values: FloatImage, size: ImageSize, is_at_corners: bool = False) -> FloatImage:
    """An (H, W) map at another (height, width): a soft one that is enlarged smoothly, all others surface by surface.

    is_at_corners: its values lie at the upper left corners of its pixels, not in their middles.
    """
    is_smooth = is_enlarged_smoothly(values, size)
    return _resampled(values, size, np.inf if is_smooth else SURFACE_SHARE * _range_of(values), is_at_corners)


def is_enlarged_smoothly(values: FloatImage, size: ImageSize) -> bool:
    """Whether a map (H, W) is smaller than (height, width) and soft, so that `resample_map` enlarges it smoothly."""
    is_larger = size[0] >= values.shape[0] and size[1] >= values.shape[1] and size != values.shape
    return is_larger and has_soft_edges(values)


def resample_surfaces(values: FloatImage, size: ImageSize) -> FloatImage:
    """An (H, W) map at another (height, width); values keep their unit, NaN is unknown before and after.

    Linear interpolation (a tent as wide as the size ratio asks for). Where the footprint spans a depth edge, the
    surface that covers more of it gives the value alone; where more than half of it is unknown, so is the result.
    """
    return _resampled(values, size, SURFACE_SHARE * _range_of(values), False)


def without_repeats(values: FloatImage) -> FloatImage:
    """A map (H, W) that was enlarged by repeating its pixels, as some networks end, as it was before; else itself."""
    for times in REPEATS:
        while all(side % times == 0 and side >= times * LEAST_SIDE for side in values.shape):
            smaller = values[::times, ::times]
            if not np.array_equal(smaller.repeat(times, 0).repeat(times, 1), values, equal_nan=True):
                break
            values = smaller
    return values


def has_soft_edges(values: FloatImage) -> bool:
    """Whether the depth edges of a map (H, W) are ramps over several pixels, by most of its strong steps."""
    values = np.where(np.isfinite(values), values, np.float32(np.nan))
    least, shares = STRONG_SHARE * _range_of(values), []
    for along in (values, values.T):
        steps = np.abs(np.diff(along, axis=1))
        if steps.shape[1] < 3:
            continue
        whole, middle = np.abs(along[:, 3:] - along[:, :-3]), steps[:, 1:-1]
        is_edge = (whole > least) & (middle >= steps[:, :-2]) & (middle >= steps[:, 2:]) & (middle > 0)
        shares.append(middle[is_edge] / whole[is_edge])
    found = np.concatenate(shares) if shares else np.empty(0)
    return bool(found.size and least > 0 and np.median(found) < EXACT_SHARE)


def _range_of(values: FloatImage) -> float:
    known = _some_known(values, max(1, values.size // 100_000))
    low, high = np.percentile(known, [2, 98]) if known.size else (0.0, 0.0)
    return float(high - low)


def _resampled(values: FloatImage, size: ImageSize, tolerance: float, is_at_corners: bool) -> FloatImage:
    result = np.empty(size, np.float32)
    _resample(np.ascontiguousarray(values, np.float32), tolerance, 0.0 if is_at_corners else 0.5, result)
    return result


def _some_known(values: FloatImage, step: int) -> FloatImage:
    """Every step-th of the finite values; a few rows at a time, or they would all be there twice."""
    found, seen = [], 0
    for first in range(0, len(values), 64):
        rows = values[first : first + 64]
        known = rows[np.isfinite(rows)]
        found.append(known[-seen % step :: step].copy())
        seen += len(known)
    return np.concatenate(found) if found else np.empty(0, np.float32)


@kernel
def _resample(values, tolerance, place, result):
    """Fill result from values; both (H, W), their pixel areas aligned at the borders. place: of the values in their
    pixels, 0.5 in the middle, 0 at the upper left corner.
    """
    step_y = values.shape[0] / result.shape[0]
    step_x = values.shape[1] / result.shape[1]
    # A tent as wide as the larger of both pixels: linear when enlarging, an average when reducing.
    radius_y, radius_x = max(1.0, step_y), max(1.0, step_x)
    for y in range(result.shape[0]):
        # Where this place of the pixel falls, counted in values.
        centre_y = (y + place) * step_y - place
        top, bottom = max(0, math.ceil(centre_y - radius_y)), min(values.shape[0] - 1, int(centre_y + radius_y))
        for x in range(result.shape[1]):
            centre_x = (x + place) * step_x - place
            left, right = max(0, math.ceil(centre_x - radius_x)), min(values.shape[1] - 1, int(centre_x + radius_x))
            # The range under the footprint: does it span a depth edge?
            low, high = np.inf, -np.inf
            for row in range(top, bottom + 1):
                for column in range(left, right + 1):
                    if abs(row - centre_y) < radius_y and abs(column - centre_x) < radius_x:
                        # Comparisons with NaN are false.
                        if values[row, column] < low:
                            low = values[row, column]
                        if values[row, column] > high:
                            high = values[row, column]
            # If so, the middle of the range parts near from far; else all counts as near.
            split = (low + high) / 2 if high - low > tolerance else -np.inf
            # Weighted means of both surfaces, and how much is unknown.
            far, far_weight, near, near_weight, unknown_weight = 0.0, 0.0, 0.0, 0.0, 0.0
            for row in range(top, bottom + 1):
                weight_y = 1 - abs(row - centre_y) / radius_y
                for column in range(left, right + 1):
                    weight = weight_y * max(0.0, 1 - abs(column - centre_x) / radius_x)
                    value = values[row, column]
                    if math.isnan(value):
                        unknown_weight += weight
                    elif value > split:
                        near += weight * value
                        near_weight += weight
                    else:
                        far += weight * value
                        far_weight += weight
            # The majority decides: unknown, near or far, never a mean of both.
            if unknown_weight > far_weight + near_weight or far_weight + near_weight == 0:
                result[y, x] = np.nan
            elif near_weight >= far_weight:
                result[y, x] = near / near_weight
            else:
                result[y, x] = far / far_weight
