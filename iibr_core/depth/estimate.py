"""A depth map of any meaning, and its disparity for a grid of views.

Depth without a scale gets the parallax that viewing plans for; depth strength and focus then change both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import TOTAL_PARALLAX, FloatImage, GridShape, InputError

Meaning = Literal["inverse depth", "metres", "disparity"]
PERCENTILES = ((1.0, 99.0), (0.1, 99.9), (0.0, 100.0))
"""Far and near end of a map without outliers; the wider pairs serve maps that are nearly one plane."""
OUTLIER_SPANS = 2.0
"""Distance of outliers from the range, in ranges, to which they are clipped: thin near objects may lie one away."""


@dataclass(frozen=True, eq=False)
class DepthEstimate:
    """Depth of a photo.

    values: (H, W) float32, NaN unknown. meaning: "inverse depth" up to an unknown positive scale and an offset, larger
    is closer; "metres" from the camera, positive; "disparity" in px per view step of a picture this large. focal_ratio:
    focal length in widths of the picture, None if it was not estimated.
    """

    values: FloatImage
    meaning: Meaning
    focal_ratio: float | None = None

    @property
    def is_metric(self) -> bool:
        """Return whether the values are metres."""
        return self.meaning == "metres"

    @property
    def nearness(self) -> NDArray[np.float64]:
        """Return the values (H, W), larger is closer: distances as inverse distances. NaN is unknown."""
        values = self.values.astype(np.float64)
        if self.is_metric:
            with np.errstate(divide="ignore", invalid="ignore"):
                values = np.where(values > 0, 1 / values, np.nan)
        values[~np.isfinite(values)] = np.nan
        return values

    @property
    def inverted(self) -> DepthEstimate:
        """Return the estimate with near and far swapped: distances become inverse distances."""
        if self.is_metric:
            return replace(self, meaning="inverse depth")
        return replace(self, values=-self.values)


def disparity_from(estimate: DepthEstimate, grid: GridShape) -> tuple[FloatImage, tuple[float, float] | None]:
    """Return the disparity of an estimate for a grid of views, and its relation to metres.

    All but disparity itself is linear in inverse depth: between its 1st and 99th percentile lies TOTAL_PARALLAX of the
    width across the grid, its median is 0, outliers are clipped.

    Returns
    -------
    disparity : (H, W) float32, px per view step; NaN is unknown.
    inverse_metres : (slope, offset) of 1 / distance in metres over the disparity, None without metres or if it is flat.

    Raises
    ------
    InputError : nothing is known.
    """
    values = estimate.nearness
    known = values[~np.isnan(values)]
    if not known.size:
        raise InputError("the depth estimate has no known value; give another map")
    if estimate.meaning == "disparity":
        return values.astype(np.float32), None
    for percentiles in PERCENTILES:
        low, high = np.percentile(known, percentiles)
        if not np.isclose(low, high, atol=0):
            break
    else:
        return (0 * values).astype(np.float32), None
    median, span = np.median(known), high - low
    px = TOTAL_PARALLAX * values.shape[1] / max(grid.rows - 1, grid.columns - 1, 1) / span
    clipped = np.clip(values, low - OUTLIER_SPANS * span, high + OUTLIER_SPANS * span)
    disparity = ((clipped - median) * px).astype(np.float32)
    return disparity, (float(1 / px), float(median)) if estimate.is_metric else None
