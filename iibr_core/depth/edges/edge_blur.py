"""How soft the depth edges of a map are, measured on edges that can be nothing but steps, blurred.

A slope, a hill or a fold may rise like a blurred step, but few have flat shoulders, and the photo changes along those
no more often than chance has it. Where nothing is sure, the blur is 0: the map stays.
"""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.edge_profiles import (
    FLAT_SHARE,
    PLATEAU_SIGMAS,
    SEARCHED_PX,
    SHARES,
    gradient,
    height_at,
    is_inside,
    strongest_change,
    structure_blur,
    walk,
)
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, ImageSize

SHARP_PX = 0.8
"""Edges blurred by less (sigma) count as exact: a step between two pixels measures 0.4, one pixel between them 0.8."""
WIDEST_MEASURED_SIGMA_PX = 16.0
EDGE_SIGMAS = sqrt(2 * np.pi)
"""The height of a blurred step over its steepest slope, in sigmas of the blur."""
MEASURED_EDGE = 0.1
"""The blur is measured on steps of at least this share of the map's range."""
MOST_BLUR_PIXELS = 300_000
MEASURED_SIGMA_PX = SEARCHED_PX / 5
"""Wider edges are measured on a smaller map."""
STEEPEST_PLATEAU = 0.3
"""Slopes beside a sharp step, relative to its own, above which it is none."""
CERTAINTY = 2.0
"""Standard deviations above chance from which the photo is believed."""
LEAST_SOFT = 0.2
"""A map of which a smaller share of edges is soft, is exact."""
MOST_SPREAD = 1 / 3
"""A filter blurs all edges of a map alike. Where the interquartile range of the blur exceeds this share of its median,
no filter made it: matching left ramps, and they stay.
"""
MOST_ENLARGED_SPREAD = 0.7
"""The same for a map that was enlarged: networks are surer of some edges than of others, but all are ramps."""


def measure_edge_blur(photo: FloatImage, disparity: FloatImage, most_spread: float = MOST_SPREAD) -> float:
    """The blur (standard deviation, px) of the depth edges of a (H, W) map; 0 where they are exact or nothing is sure.

    photo: (H, W, 3), sRGB-encoded. most_spread: see MOST_SPREAD.
    """
    steps = _steps(photo, disparity)
    soft = steps[:, steps[2] >= SHARP_PX]
    agree = soft[3, soft[4] > 0].sum()
    if not (agree > 0 and agree >= LEAST_SOFT * steps[3].sum() and _photo_is_sure(soft)):
        return 0.0
    low, middle, high = np.quantile(soft[2], (0.25, 0.5, 0.75))
    if high - low > most_spread * middle:
        return 0.0
    return min(_weighted_median(soft[2], soft[3]), WIDEST_MEASURED_SIGMA_PX)


def extent(disparity: FloatImage) -> float:
    """Robust range of a map."""
    step = max(1, disparity.size // 200_000)
    low, high = np.percentile(disparity.reshape(-1)[::step].astype(np.float64), [2, 98]) if disparity.size else (0, 0)
    return float(high - low)


def _photo_is_sure(edges: NDArray[np.float32]) -> bool:
    """Whether the photo changes at so many of them as chance would hardly have it: at half of the shoulders, with a
    variance of 1/6 for both of an edge, as of three changes in any order.
    """
    if not edges.shape[1]:
        return False
    # Edges nearer to each other show the same of the photo: they count as one.
    places = len(np.unique(edges[0] // SEARCHED_PX + (edges[1] // SEARCHED_PX) * 4096))
    return bool(edges[4].mean() >= 0.5 + CERTAINTY * sqrt(1 / 6 / places))


def _steps(photo: FloatImage, disparity: FloatImage) -> NDArray[np.float32]:
    """(5, N): x, y, blur (sigma), height, how far the photo agrees (0..1), of steps; px of the map.

    Soft ones are measured on smaller maps, where they are as short as the others.
    """
    least_edge = MEASURED_EDGE * extent(disparity)
    found: list[NDArray[np.float32]] = [np.empty((5, 0), np.float32)]
    scale, least_sigma = 1, 0.0
    while least_edge > 0 and min(disparity.shape) >= (2 if scale == 1 else 4 * SEARCHED_PX):
        edges = _steps_of_level(photo, disparity, least_edge, least_sigma, MOST_BLUR_PIXELS // scale)
        edges[:3] *= scale
        found.append(edges)
        if 2 * scale * MEASURED_SIGMA_PX > WIDEST_MEASURED_SIGMA_PX:
            break
        photo, disparity = _half(photo), _half(disparity)
        scale, least_sigma = 2 * scale, MEASURED_SIGMA_PX / 2
    return np.concatenate(found, axis=1)


def _steps_of_level(
    photo: FloatImage,
    disparity: FloatImage,
    least_edge: float,
    least_sigma: float,
    pixels: int,
) -> NDArray[np.float32]:
    """(5, N), see `_steps`; looks at as many rows as hold so many pixels."""
    step = max(1, ceil(disparity.size / pixels))
    height, width = -(-disparity.shape[0] // step), disparity.shape[1]

    def band(first: int, last: int) -> NDArray[np.float32]:
        found = np.empty((5, (last - first) * width), np.float32)
        count = _measure_edges(disparity, photo, least_edge, least_sigma, SEARCHED_PX, step, first, last, found)
        return found[:, :count].copy()

    return np.concatenate(in_bands(band, ImageSize(height, width)), axis=1)


def _weighted_median(values: FloatImage, weights: FloatImage) -> float:
    if not len(values):
        return 0.0
    order = np.argsort(values)
    share = np.cumsum(weights[order], dtype=np.float64)
    return float(values[order][np.searchsorted(share, share[-1] / 2)])


def _half(values: FloatImage) -> FloatImage:
    """Averaged over 2 x 2 pixels, (H, W) or (H, W, C)."""
    height, width = values.shape[0] // 2 * 2, values.shape[1] // 2 * 2
    even = values[:height, :width]
    return np.ascontiguousarray((even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]) / 4)


@kernel
def _measure_edges(values, photo, least_edge, least_sigma, reach, step, first, last, found):
    """At the steepest places of edges: what `_steps` says, px of these values, into found (5, N); returns how many.

    Looks at every step-th row, from the first-th to before the last-th of those.
    """
    width = values.shape[1]
    shares, taps = np.empty(SHARES), np.empty(SHARES)
    count = 0
    for row in range(first, last):
        y = row * step
        for x in range(width):
            across, down = gradient(values, x, y)
            slope = sqrt(across * across + down * down)
            # Even this slope, kept up over the whole search, makes no edge.
            if not slope * 2 * reach > least_edge:
                continue
            across, down = across / slope, down / slope
            # Both ends of the ramp, as far as they go.
            up, top, steepest_up, at_up = walk(values, x, y, across, down, 1.0, reach, 1.0, np.inf)
            back, bottom, steepest_down, at_down = walk(values, x, y, across, down, -1.0, reach, 1.0, np.inf)
            steepest = max(steepest_up, steepest_down)
            nearest = at_up if steepest_up >= steepest_down else at_down
            # Only from the steepest pixel of an edge.
            height = top - bottom
            if not (height > least_edge and nearest < 1):
                continue
            # A step blurred by a Gaussian is height / (sqrt(2 pi) sigma) steep at its middle.
            edge = at_up if steepest_up >= steepest_down else -at_down
            sigma = height / (EDGE_SIGMAS * steepest)
            # Steep within two pixels: a step, whatever the photo shows.
            agrees = 1.0
            if sigma >= SHARP_PX and _has_flat_shoulders(values, x, y, across, down, edge, sigma, steepest):
                agrees = _photo_agrees(photo, x, y, across, down, edge, sigma)
            elif sigma >= SHARP_PX:
                # A wire or a slit is no step, but two.
                top, foot = (x + across * up, y + down * up), (x - across * back, y - down * back)
                sigma, height = structure_blur(values, photo, *top, across, down, 1.0, least_edge, shares, taps)
                if sigma == 0:
                    sigma, height = structure_blur(values, photo, *foot, across, down, -1.0, least_edge, shares, taps)
            if least_sigma < sigma < MEASURED_SIGMA_PX:
                found[0, count], found[1, count] = x + across * edge, y + down * edge
                found[2, count], found[3, count], found[4, count] = sigma, height, agrees
                count += 1
    return count


@kernel
def _has_flat_shoulders(values, x, y, across, down, edge, sigma, steepest):
    near, far = PLATEAU_SIGMAS * sigma, 2 * PLATEAU_SIGMAS * sigma
    limit = FLAT_SHARE * steepest * (far - near)
    for sign in (-1.0, 1.0):
        # Outside, pixels of the border go on: as flat as nothing else is.
        if not is_inside(values, x + across * (edge + sign * far), y + down * (edge + sign * far)):
            return False
        begin = height_at(values, x + across * (edge + sign * near), y + down * (edge + sign * near))
        end = height_at(values, x + across * (edge + sign * far), y + down * (edge + sign * far))
        if not abs(end - begin) <= limit:
            return False
    return True


@kernel
def _photo_agrees(photo, x, y, across, down, edge, sigma):
    """Share of shoulders at which the photo changes less than in the middle of the edge, over the same length."""
    near = max(sigma, 1.0)
    middle = strongest_change(photo, x, y, across, down, edge - near, edge + near)
    lower = strongest_change(photo, x, y, across, down, edge - 4 * near, edge - 2 * near)
    upper = strongest_change(photo, x, y, across, down, edge + 2 * near, edge + 4 * near)
    return 0.5 * (middle > lower) + 0.5 * (middle > upper)
