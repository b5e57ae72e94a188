"""Which target rays nothing in the photo shows: those whose weights have high entropy (paper, section 3.3).

The share of a pixel that no candidate covers could come from anywhere, so it counts as spread evenly over all K
slots: a ray with one covering candidate has entropy 0, an uncovered one has 1. (The paper's threshold k = 2.3 is 99 %
of log2 5, its K = 5.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage

LEAST_COVERED = 0.2
"""A ray that its one candidate covers less than this counts as occluded: slivers of surface would look torn."""
MOSTLY_COVERED = 0.5
"""A ray covered more than this is not occluded, however many surfaces share it."""
WHOLE = 0.6
"""Where less of a ray is covered, what lies behind shows, too. Above, it is a seam rather than a rim."""


def entropy(weights: FloatImage) -> FloatImage:
    """Normalised entropy (N, W) in [0, 1] of weights (K, N, W) that sum to the covered share of each ray.

    With K = 1 it is the missing share.
    """
    return np.asarray(_entropy(weights))


def occlusion_mask(weights: FloatImage) -> NDArray[np.bool_]:
    """(N, W) bool: True where the ray is occluded in every source, that is where its entropy is above the threshold."""
    slots = weights.shape[0]
    limit = np.zeros((slots, 1, 1), np.float32)
    limit[0] = LEAST_COVERED
    return np.asarray(_mask(weights, _entropy(limit)[0, 0]))


def covered_share(weights: FloatImage) -> FloatImage:
    """(N, W) in [0, 1]: how much of each ray its candidates cover, by weights (K, N, W)."""
    return np.asarray(_covered(weights))


@kernel
def _covered(weights):
    _, rows, width = weights.shape
    result = np.empty((rows, width), np.float32)
    for row in range(rows):
        for x in range(width):
            # Most rays: the first surface covers them, and the others have no share.
            result[row, x] = 1.0
            if weights[0, row, x] < 1.0:
                result[row, x] = _coverage(weights, row, x)
    return result


@kernel
def _coverage(weights, row, x):
    # Rounding may bring the sum above 1.
    covered = 0.0
    for k in range(weights.shape[0]):
        covered += weights[k, row, x]
    return min(covered, 1.0)


@kernel
def _entropy_at(weights, row, x, covered):
    slots = weights.shape[0]
    if slots == 1:
        return 1.0 - covered
    # H(w) = -sum w log w (paper, section 3.3) over log K: 0..1 whatever K is.
    total = 0.0
    for k in range(slots):
        # The share that nothing covers is spread evenly: it could be any of them.
        p = weights[k, row, x] + (1.0 - covered) / slots
        # 0 log 0 = 0; 1 log 1, which rounding may exceed, adds nothing either.
        if 0.0 < p < 1.0:
            total -= p * np.log(p)
    return min(total / np.log(slots), 1.0)


@kernel
def _entropy(weights):
    _, rows, width = weights.shape
    result = np.empty((rows, width), np.float32)
    for row in range(rows):
        for x in range(width):
            result[row, x] = _entropy_at(weights, row, x, _coverage(weights, row, x))
    return result


@kernel
def _mask(weights, limit):
    _, rows, width = weights.shape
    mask = np.zeros((rows, width), np.bool_)
    for row in range(rows):
        for x in range(width):
            # Most rays: no sum, no logarithm.
            if weights[0, row, x] > MOSTLY_COVERED:
                continue
            covered = _coverage(weights, row, x)
            mask[row, x] = covered <= MOSTLY_COVERED and _entropy_at(weights, row, x, covered) > limit
    return mask
