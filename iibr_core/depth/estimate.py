"""A depth map before it is disparity, and its disparity for a grid of views.

Depth without a scale is given the parallax that viewing plans for; depth strength and focus then change both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import MAX_DISPARITY_WIDTHS, TOTAL_PARALLAX, FloatImage, GridShape, InputError

Meaning = Literal["inverse depth", "metres", "disparity"]
PERCENTILES = ((1.0, 99.0), (0.1, 99.9), (0.0, 100.0))
"""The near and the far end, without outliers; wider ones where nearly all is one plane."""
ROUNDING_SHARE = 1e-5
"""A range below this share of the values is rounding."""
OUTLIER_SPANS = 2.0
"""Values farther outside the range are moved to here: thin objects close by may lie a range before the rest."""

DoubleImage = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DepthEstimate:
    """Depth of a photo.

    values: (H, W) float32, NaN unknown. meaning: "inverse depth" up to an unknown positive scale and an offset, larger
    is closer; "metres" from the camera, positive; "disparity" in px per view step of a picture this large.
    """

    values: FloatImage
    meaning: Meaning

    @property
    def is_metric(self) -> bool:
        """Return whether the values are metres."""
        return self.meaning == "metres"

    @property
    def inverted(self) -> DepthEstimate:
        """The same with near and far swapped: distances become inverse distances."""
        if self.is_metric:
            return DepthEstimate(self.values, "inverse depth")
        return DepthEstimate(-self.values, self.meaning)


def disparity_from(estimate: DepthEstimate, grid: GridShape) -> FloatImage:
    """Return the disparity (H, W) float32, px per view step of the grid, of an estimate (H, W); NaN is unknown.

    Disparity counts as it is. All else is linear in inverse depth: between its 1st and 99th percentile lies
    TOTAL_PARALLAX of the width across the grid, its median stays still, outliers are moved in. Raises InputError if
    nothing is known.
    """
    if estimate.meaning == "disparity":
        return _drop_implausible(estimate.values.astype(np.float64))
    return _scale_to_viewing_range(_inverse_depth(estimate), grid)


def inverse_metres_over(estimate: DepthEstimate, values: FloatImage) -> tuple[float, float] | None:
    """Return (slope, offset) of 1 / distance in metres over the disparity (H, W) that `disparity_from` returned.

    None where the estimate is not in metres, or is flat. The fit uses both ends: beyond them outliers were moved in.
    """
    if not estimate.is_metric:
        return None
    inverse = _inverse_depth(estimate)
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


def _inverse_depth(estimate: DepthEstimate) -> DoubleImage:
    """Return inverse depth; infinitely far is known to be 0."""
    values = estimate.values.astype(np.float64)
    if estimate.is_metric:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.where(values > 0, 1 / values, np.nan)
    return _finite_or_nan(values)


def _finite_or_nan(values: NDArray[Any]) -> DoubleImage:
    known = np.where(np.isfinite(values), values, np.nan).astype(np.float64)
    if np.isnan(known).all():
        raise InputError("the depth estimate has no known value; give another map")
    return known


def _drop_implausible(disparity: DoubleImage) -> FloatImage:
    """Return the disparity, NaN where it is larger than any can be."""
    limit = MAX_DISPARITY_WIDTHS * disparity.shape[1]
    return _finite_or_nan(np.where(np.abs(disparity) > limit, np.nan, disparity)).astype(np.float32)


def _scale_to_viewing_range(inverse: DoubleImage, grid: GridShape) -> FloatImage:
    """Return inverse depth as disparity with the range that viewing plans for; 0 everywhere if it is flat."""
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
