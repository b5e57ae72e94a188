"""How much each candidate contributes to its target ray: the closed form, the limit that a trained T approaches.

Alpha compositing front to back: each surface gets what those before it leave of the pixel's area. Weights of a ray sum
to the covered share of its pixel, at most 1; what is missing is disoccluded.

The paper takes rays of high entropy for occluded (section 3.3). Here the covered share tells them: what little covers
such a ray is composited over what is filled behind it, so that no colour depends on where the line is drawn, and no
logarithm is needed. Entropy is there to be looked at. The share of a pixel that no candidate covers could come from
anywhere, so it counts as spread evenly over all K slots: a ray with one covering candidate has entropy 0, an uncovered
one has 1.
"""

from __future__ import annotations

import numpy as np

from iibr_core.rendering.candidates import Candidates
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

LEAST_COVERED = 0.2
"""A ray of which less is covered counts as occluded in every source."""
MOSTLY_COVERED = 0.5
"""A ray of which more is covered has the disparity of what covers it."""
WHOLLY_COVERED = 0.6
"""Where less of a ray is covered, what lies behind shows, too. Above, it is a seam rather than an edge."""


def visibility_weights(candidates: Candidates) -> FloatImage:
    """Weights (K, N, W) in [0, 1], 0 in unused slots; their sum over K is the covered share of the pixel."""
    return weights_and_coverage(candidates)[0]


def weights_and_coverage(candidates: Candidates) -> tuple[FloatImage, FloatImage]:
    """`visibility_weights`, and their sum (N, W): how much of each ray its candidates cover, at most 1."""
    weights = np.zeros(candidates.coverage.shape, np.float32)
    covered = np.empty(candidates.number.shape, np.float32)
    _composite_front_to_back(candidates, weights, covered)
    return weights, covered


def entropy(weights: FloatImage) -> FloatImage:
    """Normalised entropy (N, W) in [0, 1] of weights (K, N, W) that sum to the covered share of each ray.

    With K = 1 it is the missing share.
    """
    return np.asarray(_entropy(weights))


@kernel
def _composite_front_to_back(candidates, weights, covered):
    count, coverage, disparity = candidates.number, candidates.coverage, candidates.disparity
    rows, width = count.shape
    for row in range(rows):
        # Most rays: one surface, or none.
        for x in range(width):
            share = min(coverage[0, row, x], np.float32(1.0)) if count[row, x] == 1 else np.float32(0.0)
            weights[0, row, x] = covered[row, x] = share
        for x in range(width):
            used = np.int64(count[row, x])
            if used < 2:
                continue
            left = np.float32(1.0)
            ahead = np.float32(np.inf)
            ahead_slot = -1
            for _ in range(used):
                # The front-most surface behind the last one; equal disparities in slot order.
                foreground = -1
                for k in range(used):
                    d = disparity[k, row, x]
                    if (d < ahead or (d == ahead and k > ahead_slot)) and (
                        foreground < 0 or d > disparity[foreground, row, x]
                    ):
                        foreground = k
                # Nothing behind, or the pixel is full.
                if foreground < 0 or left <= 0:
                    break
                # "Over": this surface takes what is left, as far as it covers the pixel.
                ahead, ahead_slot = disparity[foreground, row, x], foreground
                weights[foreground, row, x] = min(coverage[foreground, row, x], left)
                left -= weights[foreground, row, x]
            covered[row, x] = np.float32(1.0) - left


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
