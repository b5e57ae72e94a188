"""Blur of a map's depth edges, measured on ramps that can only be blurred steps.

A slope, a hill or a fold may rise like a blurred step, but few have flat shoulders, and the photo does not change along
them more often than by chance. If nothing is certain, the blur is 0 and the map stays unchanged.
"""

from __future__ import annotations

from math import ceil, floor, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.line import FLAT_SHARE, PLATEAU_SIGMAS, gradient, height_at, is_inside, walk
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, ImageSize

SHARP_PX = 0.8
"""Least standard deviation of a soft edge, in pixels: a step between two pixels measures 0.4, with one between 0.8."""
MAX_SIGMA_PX = 4.0
"""Largest standard deviation that is measured at one size of the map, in pixels of that size."""
SIZES = 3
"""Number of sizes at which a map is measured; each is half the previous one."""
SEARCHED_PX = 20
"""Distance from an edge in which the map is examined, in pixels."""
EDGE_SIGMAS = sqrt(2 * np.pi)
"""Height of a blurred step over its steepest slope, in standard deviations of the blur."""
MEASURED_EDGE = 0.1
"""Least height of a step on which a map is measured, as a share of the map's range."""
MAX_MEASURED_PIXELS = 300_000
"""Largest number of pixels that are measured at full size."""
CERTAINTY = 2.0
"""Number of standard deviations above chance from which an agreement with the photo counts."""
MIN_SOFT_SHARE = 0.2
"""Least share of soft edges in a soft map."""
MAX_SPREAD = 1 / 3
"""Largest interquartile range of the blur in a filtered map, over its median. Ramps of other maps vary more."""
MAX_ENLARGED_SPREAD = 0.7
"""Largest such range in a map that was enlarged, whose edges are all ramps, though of different widths."""


def measure_edge_blur(photo: FloatImage, disparity: FloatImage, max_spread: float = MAX_SPREAD) -> float:
    """Return the blur of a map's depth edges: its standard deviation in pixels, 0 if they are exact or unclear.

    photo: (H, W, 3), sRGB-encoded. disparity: (H, W), finite. max_spread: see MAX_SPREAD.
    """
    steps = _steps(photo, disparity)
    soft = steps[:, steps[2] >= SHARP_PX]
    agreement = soft[3].sum()
    if not (agreement > 0 and agreement >= MIN_SOFT_SHARE * steps[3].sum() and _photo_agrees(soft)):
        return 0.0
    low, middle, high = np.quantile(soft[2], (0.25, 0.5, 0.75))
    return _weighted_median(soft[2], soft[3]) if high - low <= max_spread * middle else 0.0


def extent(disparity: FloatImage) -> float:
    """Return the robust range of a map."""
    step = max(1, disparity.size // 200_000)
    low, high = np.percentile(disparity.reshape(-1)[::step].astype(np.float64), [2, 98]) if disparity.size else (0, 0)
    return float(high - low)


def _photo_agrees(edges: NDArray[np.float32]) -> bool:
    """Return whether the photo changes at edges (4, N) more often than by chance.

    By chance it does at half of the shoulders; an edge's share of both then has a variance of 1/6, as of three changes
    in any order. Edges near to each other see the same part of the photo: they count as one.
    """
    places = len(np.unique(edges[0] // SEARCHED_PX + (edges[1] // SEARCHED_PX) * 4096))
    return bool(edges[3].mean() >= 0.5 + CERTAINTY * sqrt(1 / 6 / places))


def _steps(photo: FloatImage, disparity: FloatImage) -> NDArray[np.float32]:
    """Return x, y, blur and agreement with the photo (0..1) of steps, (4, N), in pixels.

    Wide ramps are measured on smaller maps, where they are as short as the others.
    """
    min_edge = MEASURED_EDGE * extent(disparity)
    found: list[NDArray[np.float32]] = [np.empty((4, 0), np.float32)]
    for level in range(SIZES if min_edge > 0 else 0):
        if min(disparity.shape) < (4 * SEARCHED_PX if level else 2):
            break
        min_sigma = MAX_SIGMA_PX / 2 if level else 0.0
        edges = _steps_of_size(photo, disparity, min_edge, min_sigma, MAX_MEASURED_PIXELS >> level)
        edges[:3] *= 2**level
        found.append(edges)
        photo, disparity = _half(photo), _half(disparity)
    return np.concatenate(found, axis=1)


def _steps_of_size(
    photo: FloatImage, disparity: FloatImage, min_edge: float, min_sigma: float, max_pixels: int
) -> NDArray[np.float32]:
    """Return the steps (4, N) of as many rows as hold max_pixels."""
    step = max(1, ceil(disparity.size / max_pixels))
    height, width = -(-disparity.shape[0] // step), disparity.shape[1]

    def band(first: int, last: int) -> NDArray[np.float32]:
        found = np.empty((4, (last - first) * width), np.float32)
        count = _measure_edges(disparity, photo, min_edge, min_sigma, step, (first, last), found)
        return found[:, :count].copy()

    return np.concatenate(in_bands(band, ImageSize(height, width)), axis=1)


def _weighted_median(values: FloatImage, weights: FloatImage) -> float:
    order = np.argsort(values)
    share = np.cumsum(weights[order], dtype=np.float64)
    return float(values[order][np.searchsorted(share, share[-1] / 2)])


def _half(values: FloatImage) -> FloatImage:
    """Return the means of 2 x 2 pixels of (H, W) or (H, W, C)."""
    height, width = values.shape[0] // 2 * 2, values.shape[1] // 2 * 2
    even = values[:height, :width]
    return np.ascontiguousarray((even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]) / 4)


@kernel
def _measure_edges(values, photo, min_edge, min_sigma, step, rows, found):
    """Write the steps of every step-th row, from rows[0] to before rows[1], to found (4, N); return their number."""
    count = 0
    for row in range(rows[0], rows[1]):
        y = row * step
        for x in range(values.shape[1]):
            across, down = gradient(values, x, y)
            slope = sqrt(across * across + down * down)
            # Even if the whole search is as steep, it makes no edge.
            if not slope * 2 * SEARCHED_PX > min_edge:
                continue
            across, down = across / slope, down / slope
            _, top, steepest_up, at_up = walk(values, x, y, across, down, 1.0, SEARCHED_PX, 1.0, np.inf)
            _, bottom, steepest_down, at_down = walk(values, x, y, across, down, -1.0, SEARCHED_PX, 1.0, np.inf)
            steepest, edge = (steepest_up, at_up) if steepest_up >= steepest_down else (steepest_down, -at_down)
            # An edge is measured once, from its steepest pixel.
            if not (top - bottom > min_edge and abs(edge) < 1):
                continue
            sigma, agreement = (top - bottom) / (EDGE_SIGMAS * steepest), 1.0
            if not min_sigma < sigma < MAX_SIGMA_PX:
                continue
            if sigma >= SHARP_PX:
                if not _has_flat_shoulders(values, x, y, across, down, edge, sigma, steepest):
                    continue
                agreement = _agreement(photo, x, y, across, down, edge, sigma)
            found[0, count], found[1, count] = x + across * edge, y + down * edge
            found[2, count], found[3, count] = sigma, agreement
            count += 1
    return count


@kernel
def _has_flat_shoulders(values, x, y, across, down, edge, sigma, steepest):
    """Return whether the map is flat on both sides of an edge; `edge` is its distance from (x, y) along the line."""
    near, far = PLATEAU_SIGMAS * sigma, 2 * PLATEAU_SIGMAS * sigma
    limit = FLAT_SHARE * steepest * (far - near)
    for sign in (-1.0, 1.0):
        if not is_inside(values, x + across * (edge + sign * far), y + down * (edge + sign * far)):
            return False
        begin = height_at(values, x + across * (edge + sign * near), y + down * (edge + sign * near))
        end = height_at(values, x + across * (edge + sign * far), y + down * (edge + sign * far))
        if not abs(end - begin) <= limit:
            return False
    return True


@kernel
def _agreement(photo, x, y, across, down, edge, sigma):
    """Return the share of shoulders at which the photo changes less than in the middle of the edge."""
    near = max(sigma, 1.0)
    middle = _strongest_change(photo, x, y, across, down, edge - near, edge + near)
    lower = _strongest_change(photo, x, y, across, down, edge - 4 * near, edge - 2 * near)
    upper = _strongest_change(photo, x, y, across, down, edge + 2 * near, edge + 4 * near)
    return 0.5 * (middle > lower) + 0.5 * (middle > upper)


@kernel
def _strongest_change(photo, x, y, across, down, first, last):
    """Return the largest squared change of colour over 2 px of the line through (x, y), between two distances."""
    height, width = photo.shape[:2]
    strongest = 0.0
    for k in range(floor(last - first) + 1):
        at = first + k
        x0 = min(max(floor(x + across * (at - 1) + 0.5), 0), width - 1)
        y0 = min(max(floor(y + down * (at - 1) + 0.5), 0), height - 1)
        x1 = min(max(floor(x + across * (at + 1) + 0.5), 0), width - 1)
        y1 = min(max(floor(y + down * (at + 1) + 0.5), 0), height - 1)
        change = 0.0
        for c in range(3):
            change += (photo[y1, x1, c] - photo[y0, x0, c]) ** 2
        strongest = max(strongest, change)
    return strongest
