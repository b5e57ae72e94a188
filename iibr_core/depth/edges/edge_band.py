"""Edge bands: beside a depth edge maps err, and the photo's colours tell which side a pixel belongs to.

What is left of the foreground on the background's disparity stays behind as a ghost when the view moves, and
disparities between both appear detached. Where colours do not distinguish the sides nothing changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.edge_labels import label_edges, step_distance
from iibr_core.depth.edges.edge_profiles import FLAT_SHARE
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.surfaces import is_in_front, same_surface
from iibr_core.types import FloatImage, image_size

BAND_PX = 2
"""Disparities between surfaces are counted among pixels with fewer others between them and a step; a pixel clearly lies
between two surfaces if each is flat over so many pixels.
"""
BETWEEN_SHARES = (0.1, 0.8)
"""How far up from the lower to the higher of both it lies; above that, a round thing turns away from the view."""
MIXED_EDGES = 5.0
"""Times the least edge: what lies between nearer surfaces may be a slope."""
LEAST_MEASURED = 0.025
"""Where a smaller share of the edge bands is clearly between two surfaces, it shows wires or slopes."""
MOST_NEIGHBOURS = 4
"""What lies between has at most so many neighbours on its own disparity within two pixels."""


def resolve_edge_band(
    photo: FloatImage,
    values: FloatImage,
    least_edge: float,
    unknown: NDArray[np.bool_],
    stages: Stages = ALL_STAGES,
) -> FloatImage:
    """The map (H, W) with every pixel beside a depth edge on one of its two sides, by the photo (H, W, 3).

    least_edge: the step that counts as a depth edge, more than 0. unknown: (H, W), where values were filled in.
    stages: that are on.
    Lone disparities between two surfaces, which maps have that were measured or resampled, are taken for unknown, and
    all that is unknown is filled again: mixed pixels, which look like one another, had passed them on. Then pixels
    change sides where the colours say so (`label_edges`).
    """
    colors = np.ascontiguousarray(photo, np.float32)
    is_band = step_distance(values, least_edge, BAND_PX, counts_slopes=True) < BAND_PX
    between, clear = _find_between(values, least_edge)
    is_measured = clear > LEAST_MEASURED * np.count_nonzero(is_band)
    unsure, filled = unknown, values
    if is_measured and stages.refill_between_surfaces:
        between |= _find_between(np.where(unknown, np.float32(np.nan), values), least_edge)[0]
        unsure = between | unknown
        filled = fill_disparity_by_color(colors, np.where(unsure, np.float32(np.nan), values))
    return label_edges(colors, filled, unsure, least_edge) if stages.label_edge_bands else filled


def _find_between(values: FloatImage, least_edge: float) -> tuple[NDArray[np.bool_], int]:
    """(H, W): lone pixels of no surface, between two, NaN being none; how many lie clearly between plateaus."""
    between = np.zeros(values.shape, np.bool_)
    clear = in_bands(
        lambda first, last: _find_between_rows(values, least_edge, first, last, between),
        image_size(values),
    )
    return between, sum(clear)


@kernel
def _is_between(values, y, x, right, down, least_edge):
    """Whether, along this direction, a lower plateau ends just before a pixel and a higher one begins just after it."""
    here = values[y, x]
    # One of the sides may begin a pixel later: edge bands are up to two pixels wide.
    for after in range(1, 3):
        for before in range(1, 4 - after):
            a, b = values[y + after * down, x + after * right], values[y - before * down, x - before * right]
            high, low = max(a, b), min(a, b)
            if (
                high - low > MIXED_EDGES * least_edge
                and is_in_front(high, here, least_edge)
                and is_in_front(here, low, least_edge)
                and BETWEEN_SHARES[0] * (high - low) <= here - low <= BETWEEN_SHARES[1] * (high - low)
            ):
                flat, is_flat = FLAT_SHARE * (high - low), True
                for beyond in range(1, BAND_PX + 1):
                    far_a = values[y + (after + beyond) * down, x + (after + beyond) * right]
                    far_b = values[y - (before + beyond) * down, x - (before + beyond) * right]
                    is_flat &= abs(far_a - a) <= flat and abs(far_b - b) <= flat
                if is_flat:
                    return True
    return False


@kernel
def _find_between_rows(values, least_edge, first, last, between):
    """Rows [first, last) of `_find_between`."""
    height, width = values.shape
    margin, clear = 2 + BAND_PX, 0
    for y in range(first, last):
        for x in range(width):
            here, higher, lower = values[y, x], False, False
            for v in range(max(y - 1, 0), min(y + 2, height)):
                for u in range(max(x - 1, 0), min(x + 2, width)):
                    higher |= is_in_front(values[v, u], here, least_edge)
                    lower |= is_in_front(here, values[v, u], least_edge)
            # Most pixels end here.
            if not (higher and lower):
                continue
            if margin <= y < height - margin and margin <= x < width - margin:
                clear += (
                    _is_between(values, y, x, 1, 0, least_edge)
                    or _is_between(values, y, x, 0, 1, least_edge)
                    or _is_between(values, y, x, 1, 1, least_edge)
                    or _is_between(values, y, x, 1, -1, least_edge)
                )
            # Things of two pixels and more, before one surface and behind another, have neighbours farther off.
            neighbours = -1
            for v in range(max(y - 2, 0), min(y + 3, height)):
                for u in range(max(x - 2, 0), min(x + 3, width)):
                    neighbours += same_surface(values[v, u], here, least_edge)
            between[y, x] = neighbours <= MOST_NEIGHBOURS
    return clear
