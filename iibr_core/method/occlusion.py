"""The mask M of the paper (section 3.3): which rays no source ray shows.

The paper takes rays of high entropy for occluded. Here the covered share decides: what little covers such a ray is
composited over what is inpainted behind it, so no colour depends on where the line is drawn, and no logarithm is
needed. Entropy is there to be looked at. The share of a pixel that no candidate covers could come from anywhere, so it
counts as spread evenly over all K slots: a ray with one covering candidate has entropy 0, an uncovered one has 1.
"""

from __future__ import annotations

import numpy as np

from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.rays import RaySet
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, ViewOffset

MIN_COVERED = 0.2
"""Share of a ray below which it counts as occluded in every source."""
MOSTLY_COVERED = 0.5
"""Share of a ray above which it has the disparity of what covers it."""
FULLY_COVERED = 0.6
"""Share of a ray below which what lies behind shows, too. Above, it is a seam rather than an edge."""


def entropy(weights: FloatImage) -> FloatImage:
    """Return the normalised entropy (N, W) in [0, 1] of weights (K, N, W) that sum to the covered share of each ray."""
    uncovered = 1.0 - np.minimum(weights.sum(axis=0, dtype=np.float64), 1.0)
    share = weights + uncovered / len(weights)
    # H(w) = -sum w log w over log K: 0..1 whatever K is. 0 log 0 = 0.
    logs = np.log(share, out=np.zeros_like(share), where=share > 0)
    total = -(share * logs).sum(axis=0) / np.log(len(weights))
    return np.asarray(np.clip(total, 0.0, 1.0), np.float32)


def view_entropy(rays: RaySet, offset: ViewOffset) -> FloatImage:
    """Return the entropy (H, W) of the weights of the view at `offset`."""
    found = np.empty(rays.size, np.float32)

    def band(first: int, last: int) -> None:
        found[first:last] = entropy(closed_form(find_candidates(rays, offset, (first, last)))[0])

    in_bands(band, rays.size)
    return np.ascontiguousarray(rays.in_view(found))
