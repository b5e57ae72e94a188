"""Maps and pictures at another size by their nearest pixels; disparity maps also by surfaces, or smoothly.

Exact maps get no values between foreground and background, which would float in space. Soft maps are enlarged smoothly:
they hold such values already, and the width of a ramp shows how soft they are.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ImageSize, image_size

SURFACE_SHARE = 0.02
"""Smallest difference between surfaces under one filter footprint, as a share of the map's range."""
MIN_STEP_SHARE = 0.1
"""Smallest step over four pixels, as a share of the range, that counts for the softness of a map."""
REPEATS = (2, 3)
"""Numbers of times that pixels may be repeated along each axis, alone or in a row."""
MIN_SIDE_PX = 32
"""Smallest side of a photo's map: below it, the scene itself may repeat."""
EXACT_SHARE = 0.85
"""Smallest share of a step that an exact map takes from one pixel to the next, as the median of its steps."""
SAMPLED_VALUES = 100_000


def nearest_pixels(image: NDArray[Any], size: ImageSize) -> NDArray[Any]:
    """Return an image (H, W, ...) at another (height, width) by its nearest pixels, without means of two surfaces."""
    rows, columns = ((2 * np.arange(n) + 1) * side // (2 * n) for n, side in zip(size, image_size(image)))
    return np.ascontiguousarray(image[rows][:, columns])


def resample_map(values: FloatImage, size: ImageSize) -> FloatImage:
    """Return an (H, W) map at another (height, width): a soft map is enlarged smoothly, all others by surfaces."""
    is_smooth = is_enlarged_smoothly(values, size)
    return _resampled(values, size, np.inf if is_smooth else SURFACE_SHARE * _range_of(values))


def is_enlarged_smoothly(values: FloatImage, size: ImageSize) -> bool:
    """Return whether a map (H, W) is soft and smaller than (height, width)."""
    is_larger = size[0] >= values.shape[0] and size[1] >= values.shape[1] and size != values.shape
    return is_larger and has_soft_edges(values)


def resample_surfaces(values: FloatImage, size: ImageSize) -> FloatImage:
    """Return an (H, W) map at another (height, width); values keep their unit, NaN is unknown before and after.

    Linear interpolation (a tent as wide as the size ratio asks for). Where the footprint spans a depth edge, the
    surface that covers more of it gives the value alone; where more than half of it is unknown, so is the result.
    """
    return _resampled(values, size, SURFACE_SHARE * _range_of(values))


def without_repeats(values: FloatImage) -> FloatImage:
    """Return a map (H, W) before its pixels were repeated, as some networks do at their end; else the map itself."""
    for times in REPEATS:
        while all(side % times == 0 and side >= times * MIN_SIDE_PX for side in values.shape):
            smaller = values[::times, ::times]
            if not np.array_equal(smaller.repeat(times, 0).repeat(times, 1), values, equal_nan=True):
                break
            values = smaller
    return values


def has_soft_edges(values: FloatImage) -> bool:
    """Return whether the depth edges of a map (H, W) are ramps over several pixels, by most of its strong steps."""
    values = np.where(np.isfinite(values), values, np.float32(np.nan))
    min_step, shares = MIN_STEP_SHARE * _range_of(values), [np.empty(0)]
    for rows in (values, values.T):
        if rows.shape[1] > 3:
            steps = np.abs(np.diff(rows, axis=1))
            whole, middle = np.abs(rows[:, 3:] - rows[:, :-3]), steps[:, 1:-1]
            is_edge = (whole > min_step) & (middle >= steps[:, :-2]) & (middle >= steps[:, 2:]) & (middle > 0)
            shares.append(middle[is_edge] / whole[is_edge])
    joined = np.concatenate(shares)
    return bool(joined.size and min_step > 0 and np.median(joined) < EXACT_SHARE)


def _range_of(values: FloatImage) -> float:
    step = max(1, values.size // SAMPLED_VALUES)
    known = values[np.isfinite(values)][::step]
    low, high = np.percentile(known, [2, 98]) if known.size else (0.0, 0.0)
    return float(high - low)


def _resampled(values: FloatImage, size: ImageSize, tolerance: float) -> FloatImage:
    result = np.empty(size, np.float32)
    _resample(np.ascontiguousarray(values, np.float32), tolerance, result)
    return result


@kernel
def _resample(values, tolerance, result):
    """Fill result from values; both (H, W), their pixel areas aligned at the borders."""
    step_y = values.shape[0] / result.shape[0]
    step_x = values.shape[1] / result.shape[1]
    # A tent as wide as the larger of both pixels: linear when enlarging, an average when reducing.
    radius_y, radius_x = max(1.0, step_y), max(1.0, step_x)
    for y in range(result.shape[0]):
        # Position of this pixel, counted in values.
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
            # If it does, the middle of the range separates near from far; else all values count as near.
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
