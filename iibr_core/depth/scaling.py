"""From what is known of depth to disparity for a grid of views: the scale that the kind of estimate leaves open.

What has no scale of its own is given the parallax that viewing plans for; depth strength and focus then change both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.estimates import DisparityMap, Estimate, MetricDepth, RelativeInverseDepth
from iibr_core.formats.maps.disparity_file import MAX_DISPARITY_WIDTHS
from iibr_core.types import (
    TOTAL_PARALLAX,
    FloatImage,
    GridShape,
    InputError,
)

PERCENTILES = ((1.0, 99.0), (0.1, 99.9), (0.0, 100.0))
"""The near and the far end, without a few wild values; wider ones where nearly all is one plane."""
ROUNDING_SHARE = 1e-5
"""A range below this share of the values is rounding."""
OUTLIER_SPANS = 2.0
"""Values farther outside the range are moved to here: thin things close by may well lie a range before the rest."""

DoubleImage = NDArray[np.float64]


def disparity_from(estimate: Estimate, grid: GridShape) -> FloatImage:
    """Disparity (H, W) float32, px per view step of the grid, of an estimate (H, W); NaN where it knows nothing.

    A DisparityMap counts as it is. All else is linear in inverse depth: between its 1st and 99th percentile lies
    TOTAL_PARALLAX of the width across the grid, its median stays still, outliers are moved in. Raises InputError if
    nothing is known.
    """
    match estimate:
        case DisparityMap(px_per_view):
            return _not_absurd(px_per_view.astype(np.float64))
        case MetricDepth(metres):
            return _scale_to_viewing_range(_inverse(metres), grid)
        case RelativeInverseDepth(values):
            return _scale_to_viewing_range(_finite_or_nan(values), grid)


def inverse_metres_over(estimate: Estimate, values: FloatImage) -> tuple[float, float] | None:
    """(slope, offset) of 1 / distance in metres over the disparity (H, W) that `disparity_from` made of an estimate.

    None where the estimate knows no metres, or is flat. From both ends: beyond them outliers were moved in.
    """
    if not isinstance(estimate, MetricDepth):
        return None
    inverse = _inverse(estimate.metres)
    is_known = np.isfinite(inverse) & np.isfinite(values)
    if not is_known.any():
        return None
    low = high = below = above = 0.0
    for ends in PERCENTILES:
        (low, high), (below, above) = (np.percentile(v[is_known], ends) for v in (values, inverse))
        if high > low:
            break
    slope = (above - below) / (high - low) if high > low else np.nan
    offset = below - slope * low
    return (float(slope), float(offset)) if np.isfinite(slope) and np.isfinite(offset) and slope > 0 else None


def _finite_or_nan(values: NDArray[Any]) -> DoubleImage:
    """Values, NaN where they are not finite."""
    known = np.where(np.isfinite(values), values, np.nan).astype(np.float64)
    if np.isnan(known).all():
        raise InputError("the depth estimate has no known value; give another map")
    return known


def _inverse(metres: FloatImage) -> DoubleImage:
    """1 / metres; infinitely far is known to be 0."""
    depth = metres.astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        return _finite_or_nan(np.where(depth > 0, 1 / depth, np.nan))


def _not_absurd(disparity: DoubleImage) -> FloatImage:
    """The disparity, NaN where it is larger than any can be."""
    limit = MAX_DISPARITY_WIDTHS * disparity.shape[1]
    return _finite_or_nan(np.where(np.abs(disparity) > limit, np.nan, disparity)).astype(np.float32)


def _scale_to_viewing_range(inverse: DoubleImage, grid: GridShape) -> FloatImage:
    """Inverse depth as disparity with the range that viewing plans for; 0 everywhere if it is flat."""
    known = inverse[~np.isnan(inverse)]
    low = high = 0.0
    for percentiles in PERCENTILES:
        low, high = (float(value) for value in np.percentile(known, percentiles))
        if high - low > ROUNDING_SHARE * max(abs(low), abs(high)):
            break
    else:
        return np.where(np.isnan(inverse), np.nan, 0.0).astype(np.float32)
    span = high - low
    steps = max(grid.rows - 1, grid.columns - 1, 1)
    scale = TOTAL_PARALLAX * inverse.shape[1] / steps / span
    moved_in = np.clip(inverse, low - OUTLIER_SPANS * span, high + OUTLIER_SPANS * span)
    return np.asarray((moved_in - np.median(known)) * scale, np.float32)
