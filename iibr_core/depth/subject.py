"""How near a picture's subject is: the nearest thing that takes a fair share of its middle.

A person before a wall may fill less of the middle than the wall does, so the two are separated by Otsu's threshold
(IEEE Trans. SMC 9(1), 1979) before anything is averaged.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage

MIDDLE_ROWS, MIDDLE_COLUMNS = (0.25, 0.67), (0.25, 0.75)
"""Shares of the height, where faces are, and of the width."""
HISTOGRAM_BINS = 64
STRAY_PERCENT = 1.0
"""So much of the middle at either end does not stretch the histogram."""
LEAST_SUBJECT_SHARE = 0.1
"""Of the middle, that a subject takes."""
LEAST_SEPARATION = 0.85
"""Of the variance that lies between the two parts: an even slope, a floor, has 0.75 and no nearer thing on it."""


def subject_disparity(disparity: FloatImage) -> float:
    """Disparity (H, W) of what is most likely the subject, in the map's units: the median of the nearer part of the
    middle, of all the middle where it has no two parts; 0 where nothing is known.
    """
    height, width = disparity.shape
    rows, columns = (
        [int(share * side) for share in shares] for shares, side in ((MIDDLE_ROWS, height), (MIDDLE_COLUMNS, width))
    )
    middle = disparity[rows[0] : rows[1] + 1, columns[0] : columns[1] + 1]
    known = middle[np.isfinite(middle)].astype(np.float64)
    if not known.size:
        return 0.0
    low, high = np.percentile(known, (STRAY_PERCENT, 100 - STRAY_PERCENT))
    known = np.clip(known, low, high)
    threshold, separation = _otsu(known)
    near = known[known > threshold]
    is_there = separation >= LEAST_SEPARATION and near.size >= LEAST_SUBJECT_SHARE * known.size
    return float(np.median(near if is_there else known))


def _otsu(values: NDArray[np.float64]) -> tuple[float, float]:
    """The threshold that parts the values best, and the share of their variance that lies between the parts."""
    counts, edges = np.histogram(values, HISTOGRAM_BINS)
    centres = (edges[1:] + edges[:-1]) / 2
    below = np.cumsum(counts)[:-1] / values.size
    mean, mean_below = np.sum(counts * centres) / values.size, np.cumsum(counts * centres)[:-1] / values.size
    between = (mean * below - mean_below) ** 2 / np.maximum(below * (1 - below), 1e-12)
    variance = np.sum(counts * (centres - mean) ** 2) / values.size
    best = int(np.argmax(between))
    return float(edges[best + 1]), float(between[best] / variance) if variance > 0 else 0.0
