"""Disparity of a picture's subject: the nearest thing that takes a fair share of its middle.

A person before a wall may fill less of the middle than the wall does, so the two are separated by Otsu's threshold
(IEEE Trans. SMC 9(1), 1979) before a median is taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage

MIN_SUBJECT_SHARE = 0.1
"""Smallest share of the middle that a subject takes."""
MIN_SEPARATION = 0.85
"""Smallest share of the variance that lies between subject and background: of an even slope, a floor, 0.75 does."""


def subject_disparity(disparity: FloatImage) -> float:
    """Return the disparity of the likely subject in a map (H, W), in the map's units; 0 if nothing is known.

    It is the median of the nearer part of the middle, or of the whole middle if that has no two parts.
    """
    height, width = disparity.shape
    # Faces stand a little above the middle.
    middle = disparity[height // 4 : 2 * height // 3 + 1, width // 4 : 3 * width // 4 + 1]
    known = middle[np.isfinite(middle)].astype(np.float64)
    if not known.size:
        return 0.0
    known = np.clip(known, *np.percentile(known, (1, 99)))
    threshold, separation = _otsu(known)
    near = known[known > threshold]
    has_subject = separation >= MIN_SEPARATION and near.size >= MIN_SUBJECT_SHARE * known.size
    return float(np.median(near if has_subject else known))


def _otsu(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the threshold that separates the values best, and the share of their variance between the two parts."""
    counts, edges = np.histogram(values, bins=64)
    shares, centres = counts / values.size, (edges[1:] + edges[:-1]) / 2
    mean, below, mean_below = np.sum(shares * centres), np.cumsum(shares)[:-1], np.cumsum(shares * centres)[:-1]
    between = (mean * below - mean_below) ** 2 / np.maximum(below * (1 - below), 1e-12)
    variance = np.sum(shares * (centres - mean) ** 2)
    best = int(np.argmax(between))
    return float(edges[best + 1]), float(between[best] / variance) if variance > 0 else 0.0
