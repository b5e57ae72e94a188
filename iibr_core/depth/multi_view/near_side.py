"""Which end of the disparities is near: near surfaces hide far ones, which matching alone does not show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, ViewOffset

MIN_HIDING_PX = 1.5
"""Least shift between two surfaces in a view in which one of them hides the other."""
MAX_LUMA_DIFFERENCE = 0.1
"""Difference of luma that counts most: larger ones count the same."""
MIN_SLOPE = 0.01
"""Least step of luma from pixel to pixel of a place whose disparity is known."""
MIN_HIDDEN_SHARE = 0.0005
"""Smallest share of all pixels of the views that must be hidden on either assumption."""
MIN_AGREEING = 0.9
"""Smallest share of the hidden pixels that lie in views that show the same side as near."""


def nearness_ratio(lumas: Sequence[FloatImage], offsets: Sequence[ViewOffset], values: FloatImage) -> float:
    """Return how much worse places match that are hidden if larger disparities are nearer than places that are hidden
    if smaller ones are: above 1 larger ones are nearer, below 1 smaller ones; 1 if too little is hidden, or views
    disagree.

    lumas: (H, W), 0 .. 1, of small views, the reference first; offsets: their viewpoints from it. values: disparity
    (H, W) of the reference.
    """
    sums, counts, total = np.zeros((len(lumas), 2)), np.zeros((len(lumas), 2)), 0
    slopes = np.gradient(lumas[0])
    is_textured = np.hypot(*slopes) > MIN_SLOPE
    for k, (luma, (t, s)) in enumerate(zip(lumas, offsets)):
        if t == s == 0:
            continue
        places, is_inside = _places(values, t, s)
        difference = luma.ravel()[places] - lumas[0]
        away = np.minimum(np.abs(difference - np.median(difference[is_inside])), MAX_LUMA_DIFFERENCE)
        margin = MIN_HIDING_PX / max(abs(t), abs(s))
        total += int(is_inside.sum())
        for side, sign in enumerate((1, -1)):
            is_hidden = is_textured & is_inside & _hidden(sign * values, places, is_textured, margin)
            sums[k, side], counts[k, side] = away[is_hidden].sum(), is_hidden.sum()
    if counts.sum(axis=0).min() <= MIN_HIDDEN_SHARE * total:
        return 1.0
    larger, smaller = sums.sum(axis=0) / counts.sum(axis=0) + 1e-3
    agrees = ((sums / np.maximum(counts, 1)) @ (1, -1) > 0) == (larger > smaller)
    return float(larger / smaller) if counts[agrees].sum() >= MIN_AGREEING * counts.sum() else 1.0


def _places(values: FloatImage, t: float, s: float) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the pixels (H, W) at which a view shows the places of the reference, and whether they lie in it."""
    height, width = values.shape
    rows, columns = np.indices(values.shape)
    y, x = np.rint(rows - values * t).astype(int), np.rint(columns - values * s).astype(int)
    is_inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
    return np.where(is_inside, y * width + x, 0), is_inside


def _hidden(
    values: FloatImage, places: NDArray[np.int64], is_textured: NDArray[np.bool_], margin: float
) -> NDArray[np.bool_]:
    """Return which pixels (H, W) a textured one hides that has a larger value, by more than a margin."""
    front = np.full(values.size, -np.inf, np.float32)
    np.maximum.at(front, places[is_textured], values[is_textured])
    return front[places] > values + margin
