"""How much each candidate contributes to its target ray: the closed form, the limit that a trained T approaches.

Alpha compositing front to back: each surface gets what those before it leave of the pixel's area. Weights of a ray sum
to the covered share of its pixel, at most 1; what is missing is disoccluded.
"""

from __future__ import annotations

import numpy as np

from iibr_core.rendering.candidates import Candidates
from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage


def visibility_weights(candidates: Candidates) -> FloatImage:
    """Weights (K, N, W) in [0, 1], 0 in unused slots; their sum over K is the covered share of the pixel."""
    weights = np.zeros_like(candidates.coverage)
    _composite_front_to_back(candidates, weights)
    return weights


@kernel
def _composite_front_to_back(candidates, weights):
    count, coverage, disparity = candidates.number, candidates.coverage, candidates.disparity
    rows, width = count.shape
    for row in range(rows):
        for x in range(width):
            used = np.int64(count[row, x])
            # Most rays: one surface.
            if used == 1:
                weights[0, row, x] = min(coverage[0, row, x], np.float32(1.0))
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
