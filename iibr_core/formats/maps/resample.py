"""Disparity maps at another size, without values between foreground and background: such pixels would fly free in
space.
"""

from __future__ import annotations

import math

import numpy as np

from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage, ImageSize

# Values under one filter footprint that differ by more than this share of the map's range belong to different surfaces.
SURFACE_SHARE = 0.02


def resample_surfaces(values: FloatImage, size: ImageSize) -> FloatImage:
    """An (H, W) map at another (height, width); values keep their unit, NaN is unknown before and after.

    Linear interpolation (a tent as wide as the size ratio asks for). Where the footprint spans a depth edge, the
    surface that covers more of it gives the value alone; where more than half of it is unknown, so is the result.
    """
    known = _some_known(values, max(1, values.size // 100_000))
    low, high = np.percentile(known, [2, 98]) if known.size else (0.0, 0.0)
    result = np.empty(size, np.float32)
    _resample(np.ascontiguousarray(values, np.float32), SURFACE_SHARE * (high - low), result)
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
def _resample(values, tolerance, result):
    """Fill result from values; both (H, W), their pixel areas aligned at the borders."""
    step_y = values.shape[0] / result.shape[0]
    step_x = values.shape[1] / result.shape[1]
    # A tent as wide as the larger of both pixels: linear when enlarging, an average when reducing.
    radius_y, radius_x = max(1.0, step_y), max(1.0, step_x)
    for y in range(result.shape[0]):
        # Pixel areas are aligned at the borders, hence the halves.
        centre_y = (y + 0.5) * step_y - 0.5
        top, bottom = max(0, math.ceil(centre_y - radius_y)), min(values.shape[0] - 1, int(centre_y + radius_y))
        for x in range(result.shape[1]):
            centre_x = (x + 0.5) * step_x - 0.5
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
