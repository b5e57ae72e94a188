"""The range of a disparity map: how far the scene reaches from its farthest to its nearest, and how surely.

Lone wild pixels do not count, small objects do; noise is no range, however far it is amplified.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iibr_core.types import FloatImage

MIN_SHARE_PERCENT = 0.02
"""Share of the picture, in percent, below which wild values do not set the range."""
NOISE_OF_SECOND_DIFFERENCE = 1.652
"""Median of |a - 2b + c| over the deviation of independent Gaussian noise in a, b and c."""
MIN_RANGE_DEVIATIONS = 4.0
"""A range of less than so many deviations of the noise is noise itself."""
MIN_RELATIVE_RANGE = 1e-4
"""A range below this share of the disparities it is found at lies beyond what maps state."""

MAX_ROUNDING_STEP = 1 / 30
"""Largest step of rounding as a share of the range, that of five bits: larger ones are edges."""


@dataclass(frozen=True)
class DisparityRange:
    """The farthest (low) and the nearest (high) disparity that count, equal if the map is flat.

    noise: standard deviation of the noise from pixel to pixel. All in the map's units.
    """

    low: float
    high: float
    noise: float

    @property
    def range(self) -> float:
        """The difference of the nearest and the farthest disparity."""
        return self.high - self.low


def measure_disparity_range(disparity: FloatImage) -> DisparityRange:
    """Return the range of a map (H, W); values that are not finite count as its median.

    Values count if they fill a few squares of three by three pixels.
    """
    finite = np.isfinite(disparity)
    middle = float(np.median(disparity[finite])) if finite.any() else 0.0
    if not finite.all():
        disparity = np.where(finite, disparity, np.float32(middle))
    low = float(np.percentile(_of_squares(disparity, np.maximum), MIN_SHARE_PERCENT))
    high = float(np.percentile(_of_squares(disparity, np.minimum), 100 - MIN_SHARE_PERCENT))
    noise = min(_noise(disparity), _noise(disparity.T))
    if high - low <= max(MIN_RANGE_DEVIATIONS * noise, MIN_RELATIVE_RANGE * max(abs(low), abs(high))):
        return DisparityRange(middle, middle, noise)
    return DisparityRange(low, high, noise)


def rounding_step(disparity: FloatImage) -> float:
    """Return the step to which the values of a map (H, W) are rounded, as quarter pixels or 8 bits.

    It is the median step between neighbours that differ: 0 if such steps are edges; the usual slope of maps that are
    not rounded.
    """
    steps = np.concatenate([np.abs(np.diff(disparity, axis=axis)).ravel() for axis in (0, 1)])
    range_ = measure_disparity_range(disparity).range
    steps = steps[steps > MIN_RELATIVE_RANGE * range_]
    step = float(np.median(steps)) if steps.size else 0.0
    return step if step <= MAX_ROUNDING_STEP * range_ else 0.0


def _of_squares(values: FloatImage, extreme: np.ufunc) -> FloatImage:
    """Return the extreme of each three by three pixels; of fewer where the picture is smaller."""
    for _ in range(2):
        values = extreme(values[1:], values[:-1]) if len(values) > 1 else values
        values = extreme(values[:, 1:], values[:, :-1]) if values.shape[1] > 1 else values
    return values


def _noise(values: FloatImage) -> float:
    """Return the standard deviation of independent noise in the rows of the map; planes have none."""
    second = values[:, 2:] - 2 * values[:, 1:-1] + values[:, :-2]
    return float(np.median(np.abs(second))) / NOISE_OF_SECOND_DIFFERENCE if second.size else 0.0
