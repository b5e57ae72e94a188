"""The weights w of the paper (section 3.2) in closed form: the limit that a trained transformer approaches.

Alpha compositing front to back: each surface gets what those before it leave of the pixel's area. Weights of a ray sum
to the covered share of its pixel, at most 1; the rest is disoccluded.
"""

from __future__ import annotations

import numpy as np

from iibr_core.method.candidates import Candidates
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage


def closed_form(candidates: Candidates) -> tuple[FloatImage, FloatImage]:
    """Return the weights (K, N, W), 0 to 1, 0 in unused slots, and their sum (N, W), the covered share of each ray."""
    weights = np.zeros(candidates.coverage.shape, np.float32)
    covered = np.empty(candidates.number.shape, np.float32)
    _composite_front_to_back(candidates, weights, covered)
    return weights, covered


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
                # The operator "over": this surface takes its coverage of the remaining share.
                ahead, ahead_slot = disparity[foreground, row, x], foreground
                weights[foreground, row, x] = min(coverage[foreground, row, x], left)
                left -= weights[foreground, row, x]
            covered[row, x] = np.float32(1.0) - left
