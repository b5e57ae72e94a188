"""Crumbs: a few pixels of a measured map at a disparity that nothing around them has. In other views they fly about.

Thin things, whose pixels hang together, are none. Exact maps have pixels of their own on steep surfaces and in hair.
"""

from __future__ import annotations

import numpy as np

from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands
from iibr_core.types import FloatImage, image_size

MOST_PX = 3
"""More pixels together are a thing."""
MOST_SHARE = 0.1
"""A map of which more is crumbs is noise, or nothing but detail: it stays."""


def fill_crumbs(photo: FloatImage, values: FloatImage, step: float, should_stop: ShouldStop) -> FloatImage:
    """The map (H, W) with its crumbs filled by what looks like them around them, by the photo (H, W, 3).

    step: neighbours on one surface differ by no more. Raises Cancelled once should_stop is true.
    """
    crumbs = np.zeros(values.shape, np.bool_)
    in_bands(lambda first, last: _find_crumbs(values, step, first, last, crumbs), image_size(values), should_stop)
    if not 0 < np.count_nonzero(crumbs) <= MOST_SHARE * crumbs.size:
        return values
    return fill_disparity_by_color(photo, np.where(crumbs, np.float32(np.nan), values), should_stop)


@kernel
def _find_crumbs(values, step, first, last, crumbs):
    """Mark in rows [first, last) the pixels that hang together with fewer than MOST_PX others, diagonally too."""
    height, width = values.shape
    together = np.empty((MOST_PX + 9, 2), np.int64)
    for y in range(first, last):
        for x in range(width):
            # A flood that ends as soon as it is too large.
            together[0, 0], together[0, 1], count, looked_at = y, x, 1, 0
            while looked_at < count <= MOST_PX:
                near_y, near_x = together[looked_at]
                looked_at += 1
                for v in range(max(near_y - 1, 0), min(near_y + 2, height)):
                    for u in range(max(near_x - 1, 0), min(near_x + 2, width)):
                        if not abs(values[v, u] - values[near_y, near_x]) <= step:
                            continue
                        is_new = True
                        for n in range(count):
                            is_new &= together[n, 0] != v or together[n, 1] != u
                        if is_new:
                            together[count, 0], together[count, 1] = v, u
                            count += 1
            crumbs[y, x] = count <= MOST_PX
