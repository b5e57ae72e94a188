"""Lone disparities between two surfaces, as mixed pixels get them in maps that were measured or resampled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.labels import step_distance
from iibr_core.depth.edges.line import FLAT_SHARE
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import is_in_front, same_surface
from iibr_core.types import FloatImage, image_size

BAND_PX = 2
"""Width of an edge band, and of the plateaus beside it, in pixels."""
MIN_BETWEEN_SHARE = 0.025
"""Least share of pixels clearly between two plateaus in the edge bands of measured or resampled maps."""


def fill_lone(
    colors: FloatImage, values: FloatImage, holes: NDArray[np.bool_], min_edge: float
) -> tuple[FloatImage, NDArray[np.bool_]]:
    """Return a map (H, W) whose lone disparities and holes are filled by colour, and the pixels that were filled.

    Exact maps are returned unchanged: their lone disparities are wires and meshes. holes (H, W): pixels that were
    filled before, perhaps with lone disparities.
    """
    lone, between = _find_lone(values, min_edge)
    band = step_distance(values, min_edge, BAND_PX, counts_slopes=True) < BAND_PX
    if between <= MIN_BETWEEN_SHARE * np.count_nonzero(band):
        return values, holes
    filled = holes | lone | _find_lone(np.where(holes, np.float32(np.nan), values), min_edge)[0]
    return fill_disparity_by_color(colors, np.where(filled, np.float32(np.nan), values)), filled


def _find_lone(values: FloatImage, min_edge: float) -> tuple[NDArray[np.bool_], int]:
    """Return lone pixels (H, W), and the number of pixels clearly between two plateaus. NaN is on no surface."""
    lone = np.zeros(values.shape, np.bool_)
    between = in_bands(lambda first, last: _find_lone_rows(values, min_edge, first, last, lone), image_size(values))
    return lone, sum(between)


@kernel
def _is_between(values, y, x, right, down, min_edge):
    """Return whether, along a direction, a plateau ends just before a pixel and a higher one begins just after it."""
    here = values[y, x]
    # One side may begin a pixel later, as edge bands are up to two pixels wide.
    for after, before in ((1, 1), (1, 2), (2, 1)):
        a, b = values[y + after * down, x + after * right], values[y - before * down, x - before * right]
        high, low = max(a, b), min(a, b)
        # Nearly as high as the higher surface: a round thing that turns away from the view.
        if not (is_in_front(here, low, min_edge) and min_edge < high - here and here - low <= 0.8 * (high - low)):
            continue
        flat, is_flat = FLAT_SHARE * (high - low), high - low > 5.0 * min_edge
        for beyond in range(1, BAND_PX + 1):
            far_a = values[y + (after + beyond) * down, x + (after + beyond) * right]
            far_b = values[y - (before + beyond) * down, x - (before + beyond) * right]
            is_flat &= abs(far_a - a) <= flat and abs(far_b - b) <= flat
        if is_flat:
            return True
    return False


@kernel
def _find_lone_rows(values, min_edge, first, last, lone):
    """Mark the lone pixels of rows [first, last); return the number of pixels clearly between plateaus."""
    height, width = values.shape
    margin, between = 2 + BAND_PX, 0
    for y in range(first, last):
        for x in range(width):
            here, neighbours, is_higher, is_lower = values[y, x], -1, False, False
            for v in range(max(y - 1, 0), min(y + 2, height)):
                for u in range(max(x - 1, 0), min(x + 2, width)):
                    is_higher |= is_in_front(here, values[v, u], min_edge)
                    is_lower |= is_in_front(values[v, u], here, min_edge)
            if not (is_higher and is_lower):
                continue
            if margin <= y < height - margin and margin <= x < width - margin:
                between += (
                    _is_between(values, y, x, 1, 0, min_edge)
                    or _is_between(values, y, x, 0, 1, min_edge)
                    or _is_between(values, y, x, 1, 1, min_edge)
                    or _is_between(values, y, x, 1, -1, min_edge)
                )
            # Things of two pixels and more have at least five neighbours of theirs.
            for v in range(max(y - 2, 0), min(y + 3, height)):
                for u in range(max(x - 2, 0), min(x + 3, width)):
                    neighbours += same_surface(values[v, u], here, min_edge)
            lone[y, x] = neighbours < 5
    return between
