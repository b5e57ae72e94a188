"""How much of each target ray the photo shows, and how sure its weights are (entropy: paper, section 3.3).

The paper takes rays of high entropy for occluded. Here the covered share tells them: what little covers such a ray is
composited over what is filled behind it, so that no colour depends on where the line is drawn, and no logarithm is
needed. Entropy is there to be looked at. The share of a pixel that no candidate covers could come from anywhere, so it
counts as spread evenly over all K slots: a ray with one covering candidate has entropy 0, an uncovered one has 1.
"""

from __future__ import annotations

import numpy as np

from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage

LEAST_COVERED = 0.2
"""A ray of which less is covered counts as occluded in every source."""
MOSTLY_COVERED = 0.5
"""A ray of which more is covered has the disparity of what covers it."""
WHOLLY_COVERED = 0.6
"""Where less of a ray is covered, what lies behind shows, too. Above, it is a seam rather than an edge."""


def entropy(weights: FloatImage) -> FloatImage:
    """Normalised entropy (N, W) in [0, 1] of weights (K, N, W) that sum to the covered share of each ray.

    With K = 1 it is the missing share.
    """
    return np.asarray(_entropy(weights))


@kernel
def _coverage(weights, row, x):
    # Rounding may bring the sum above 1.
    covered = 0.0
    for k in range(weights.shape[0]):
        covered += weights[k, row, x]
    return min(covered, 1.0)


@kernel
def _entropy(weights):
    slots, rows, width = weights.shape
    result = np.empty((rows, width), np.float32)
    for row in range(rows):
        for x in range(width):
            covered = _coverage(weights, row, x)
            # H(w) = -sum w log w (paper, section 3.3) over log K: 0..1 whatever K is.
            total = 0.0
            for k in range(slots):
                # The share that nothing covers is spread evenly: it could be any of them.
                p = weights[k, row, x] + (1.0 - covered) / slots
                # 0 log 0 = 0; 1 log 1, which rounding may exceed, adds nothing either.
                if 0.0 < p < 1.0:
                    total -= p * np.log(p)
            result[row, x] = 1.0 - covered if slots == 1 else min(total / np.log(slots), 1.0)
    return result
