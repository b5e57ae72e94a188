"""Sharp depth edges from soft ones: what lies between foreground and background is given to one of them.

A soft map is a sharp one, blurred; how much is measured on the map itself. Only slopes that such a blur makes of a step
are changed, so exact maps and slanted surfaces stay as they are.
"""

from __future__ import annotations

from math import ceil, floor, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.disparity_holes import fill_disparity_holes
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.types import FloatImage, ImageSize, InputError, image_size

SHARP_PX = 0.65
"""Edges blurred by less (sigma) count as exact: a step between two pixels measures 0.4, one pixel between them 0.8."""
LEAST_EDGE = 0.03
"""Lower steps are left alone: share of the map's range."""
MEASURED_EDGE = 0.1
"""The blur is measured on steps of at least this share of the range."""
MEASURED_PIXELS = 300_000
MEASURING_REACH_PX = 20
WIDEST_SIGMA_PX = 16.0
EDGE_SIGMAS = sqrt(2 * np.pi)
"""The height of a blurred step over its steepest slope, in sigmas of the blur."""
STEEPEST_PLATEAU = 0.35
"""Slopes beside a ramp, relative to its own, above which it is no step between two surfaces."""
FLATNESS = 0.08
"""A ramp ends where its slope falls below this share of its steepest."""
TOLERANCE = 1.5
"""A ramp may be longer than the blur makes it by this factor; longer ones are surfaces."""
PLATEAU_SIGMAS = 2.0
"""From a ramp's steepest place to its plateaus, at most."""
COLOR_SIGMAS = 1.0
"""From there to where the colours of both surfaces are taken, beyond one pixel; nearer ones are shaded more alike."""
COLOR_SHARE = 0.5
"""How much the photo counts against the height on the ramp in deciding for a surface."""
COLOR_NOISE = 0.003
"""Squared distance of colours (sRGB-encoded) that tells nothing."""
EXTENSION = 0.7
"""How far the plateaus' own slopes are continued under the ramp: 1 = all the way."""
MOST_EXTENSION = 0.05
"""Limit on those slopes, relative to the ramp's steepest."""
STEPS_A_SIGMA = 2.5
"""Ramps are walked in steps so fine, or of a pixel."""
FINE_STRENGTH = 1e-3


def refine(
    photo: FloatImage, disparity: FloatImage, strength: float = 1.0, should_stop: ShouldStop = never
) -> FloatImage:
    """The disparity with its soft edges snapped to the photo's edges; no values between foreground and background.

    photo: (H, W, 3), sRGB-encoded. disparity: (H, W), any unit in which larger is closer; what is not finite is filled
    from its background side. strength: 0 changes nothing, 1 makes steps, between them the slopes are shortened.
    Returns (H, W) float32, within the range of what was given but for a slope's continuation.
    Raises ValueError if the sizes differ, InputError if strength is not within 0..1 or no disparity is known, Cancelled
    once should_stop is true.
    """
    if photo.shape != (*disparity.shape, 3):
        raise ValueError(f"the photo is {photo.shape}, the disparity {disparity.shape}")
    if not 0 <= strength <= 1:
        raise InputError(f"refinement strength {strength}: give a number from 0 (off) to 1")
    values = _fill_unknown(disparity, should_stop)
    sigma = edge_blur_px(values, should_stop) if strength > 0 else 0.0
    if sigma < SHARP_PX:
        return values
    refined = np.empty_like(values)
    colors = np.ascontiguousarray(photo, np.float32)
    least_edge, softness = LEAST_EDGE * _extent(values), max(1.0 - strength, FINE_STRENGTH)

    def band(first: int, last: int) -> None:
        _refine(values, colors, least_edge, sigma, softness, first, last, refined)

    in_bands(band, image_size(values), should_stop)
    return refined


def edge_blur_px(disparity: FloatImage, should_stop: ShouldStop = never) -> float:
    """Standard deviation (px) of the blur that made the depth edges of an (H, W) map as soft as they are.

    The median over its larger edges, each counting by its height. About 0.4 for exact maps; 0 without edges.
    Raises Cancelled once should_stop is true.
    """
    height, width = disparity.shape
    extent = _extent(disparity)
    if not extent > 0 or min(height, width) < 2:
        return 0.0
    # Measured on ever smaller maps until ramps are short against the reach of the search.
    coarser = 0
    while True:
        sigmas, heights = _edges(disparity, MEASURED_EDGE * extent, should_stop)
        sigma = _weighted_median(sigmas, heights) * 2.0**coarser
        # A ramp as long as the reach of the search is measured on a smaller map.
        measured = len(sigmas) and sigma < MEASURING_REACH_PX / 5 * 2**coarser
        if measured or min(disparity.shape) < 4 * MEASURING_REACH_PX:
            return min(sigma, WIDEST_SIGMA_PX)
        disparity = _downsample(disparity)
        coarser += 1


def _edges(disparity: FloatImage, least_edge: float, should_stop: ShouldStop) -> NDArray[np.float32]:
    """(2, N): blur (sigma, px) and height of edges; looks at as many rows as hold MEASURED_PIXELS."""
    step = max(1, ceil(sqrt(disparity.size / MEASURED_PIXELS)))
    height, width = -(-disparity.shape[0] // step), disparity.shape[1]

    def band(first: int, last: int) -> NDArray[np.float32]:
        found = np.empty((2, (last - first) * width), np.float32)
        count = _measure_edges(disparity, least_edge, MEASURING_REACH_PX, step, first, last, *found)
        return found[:, :count].copy()

    return np.concatenate(in_bands(band, ImageSize(height, width), should_stop), axis=1)


def _fill_unknown(disparity: FloatImage, should_stop: ShouldStop) -> FloatImage:
    known = np.where(np.isfinite(disparity), disparity, np.nan).astype(np.float32)
    if known.size and np.isnan(known).all():
        raise InputError("refining depth edges: no disparity is known; give another map")
    return fill_disparity_holes(known, should_stop) if np.isnan(known).any() else known


def _extent(disparity: FloatImage) -> float:
    """Robust range of a map."""
    step = max(1, disparity.size // 200_000)
    low, high = np.percentile(disparity.reshape(-1)[::step].astype(np.float64), [2, 98]) if disparity.size else (0, 0)
    return float(high - low)


def _weighted_median(values: FloatImage, weights: FloatImage) -> float:
    if not len(values):
        return 0.0
    order = np.argsort(values)
    share = np.cumsum(weights[order], dtype=np.float64)
    return float(values[order][np.searchsorted(share, share[-1] / 2)])


def _downsample(values: FloatImage) -> FloatImage:
    height, width = values.shape[0] // 2 * 2, values.shape[1] // 2 * 2
    return np.ascontiguousarray(values[:height, :width].reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3)))


@kernel
def _at(values, x, y):
    """The map at a real position, bilinear; its border pixels continue outside."""
    height, width = values.shape
    # The last cell of pixels is used up to its far end: both taps exist even there.
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    left, top = min(int(x), width - 2), min(int(y), height - 2)
    u, v = x - left, y - top
    above = values[top, left] * (1.0 - u) + values[top, left + 1] * u
    below = values[top + 1, left] * (1.0 - u) + values[top + 1, left + 1] * u
    return above * (1.0 - v) + below * v


@kernel
def _gradient(values, x, y):
    """Gradient (x, y) of the map about a pixel, over 5 x 5."""
    height, width = values.shape
    across = down = 0.0
    # Separable: binomial smoothing (1 4 6 4 1) along one axis, smoothed differences (-1 -2 0 2 1) along the other.
    for j in range(-2, 3):
        row = min(max(y + j, 0), height - 1)
        smooth_j = (6.0 if j == 0 else 4.0 if abs(j) == 1 else 1.0) / 16.0
        slope_j = (2.0 if abs(j) == 1 else 1.0) * np.sign(j) / 8.0
        for i in range(-2, 3):
            value = values[row, min(max(x + i, 0), width - 1)]
            smooth_i = (6.0 if i == 0 else 4.0 if abs(i) == 1 else 1.0) / 16.0
            slope_i = (2.0 if abs(i) == 1 else 1.0) * np.sign(i) / 8.0
            across += smooth_j * slope_i * value
            down += slope_j * smooth_i * value
    return across, down


@kernel
def _walk(values, x, y, across, down, sign, reach, pace, beyond):
    """From (x, y) up (sign 1) or down (-1) the ramp: (length, value at its end, slope there, steepest slope, where).

    reach: at most so many steps; pace: of so many pixels; beyond: no farther than that past the steepest place, px.
    """
    before, steepest, slope, last, steepest_at = _at(values, x, y), 0.0, 0.0, 0.0, 0.0
    # A march along the gradient, one sample a step.
    for k in range(1, reach + 1):
        far = sign * k * pace
        value = _at(values, x + far * across, y + far * down)
        # Rise a pixel since the last sample, positive both ways along the ramp.
        slope = (value - before) * sign / pace
        levelled = slope < 0.5 * steepest and slope > 0.85 * last
        # The plateau: nearly flat, or no longer rising, or levelled off on a slanted surface, or too far past the edge.
        if slope <= FLATNESS * steepest or slope <= 0 or levelled or (k - 1) * pace > steepest_at + beyond:
            return (k - 1) * pace, before, slope, steepest, steepest_at
        if slope > steepest:
            steepest, steepest_at = slope, (k - 0.5) * pace
        last, before = slope, value
    return reach * pace, before, slope, steepest, steepest_at


@kernel
def _measure_edges(values, least_edge, reach, step, first, last, sigmas, heights):
    """At the steepest places of edges: their blur (sigma, px) and height; returns how many.

    Looks at every step-th row, from the first-th to before the last-th of those.
    """
    width = values.shape[1]
    count = 0
    for row in range(first, last):
        y = row * step
        for x in range(width):
            across, down = _gradient(values, x, y)
            slope = sqrt(across * across + down * down)
            # Even this slope, kept up over the whole search, makes no edge.
            if not slope * 2 * reach > least_edge:
                continue
            across, down = across / slope, down / slope
            # Both ends of the ramp, as far as they go.
            _, top, end_up, steepest_up, at_up = _walk(values, x, y, across, down, 1.0, reach, 1.0, np.inf)
            _, bottom, end_down, steepest_down, at_down = _walk(values, x, y, across, down, -1.0, reach, 1.0, np.inf)
            steepest = max(steepest_up, steepest_down)
            nearest = at_up if steepest_up >= steepest_down else at_down
            # Only from the steepest pixel of an edge, and where plateaus are flat: else it is a slanted surface.
            if top - bottom > least_edge and nearest < 1 and max(end_up, end_down) <= STEEPEST_PLATEAU * steepest:
                # A step blurred by a Gaussian is height / (sqrt(2 pi) sigma) steep at its middle.
                sigmas[count] = (top - bottom) / (EDGE_SIGMAS * steepest)
                heights[count] = top - bottom
                count += 1
    return count


@kernel
def _continue_plateau(values, x, y, across, down, length, level, limit):
    """The height at (x, y) of a plateau that begins `length` away at `level`, from its slope over two pixels there."""
    far = length + 2
    slope = (_at(values, x + across * far, y + down * far) - level) / 2
    return level - EXTENSION * length * min(max(slope, -limit), limit)


@kernel
def _foreground_colour(photo, x, y, across, down, front, behind):
    """Matting: a colour between those so far away; -0.5 background .. 0.5 foreground, nearer 0 the less sure."""
    height, width = photo.shape[:2]
    # Pixels of both surfaces, beyond the ramp.
    front_x = min(max(floor(x + across * front + 0.5), 0), width - 1)
    front_y = min(max(floor(y + down * front + 0.5), 0), height - 1)
    back_x = min(max(floor(x - across * behind + 0.5), 0), width - 1)
    back_y = min(max(floor(y - down * behind + 0.5), 0), height - 1)
    # Matting: where the colour lies on the line between theirs, how far apart they are, how far off it is.
    along = contrast = away = 0.0
    for c in range(3):
        background = photo[back_y, back_x, c]
        difference = photo[front_y, front_x, c] - background
        own = photo[y, x, c] - background
        along, contrast, away = along + own * difference, contrast + difference**2, away + own**2
    share = along / max(contrast, 1e-9)
    # Sure where both surfaces differ by more than noise and the colour lies on the line.
    residual = max(away - share * along, 0.0)
    return (min(max(share, 0.0), 1.0) - 0.5) * contrast / (contrast + residual + COLOR_NOISE)


@kernel
def _refine(values, photo, least_edge, sigma, softness, first_row, last_row, refined):
    """Rows [first_row, last_row) of the refined map. softness: 0 = steps, 1 = as given."""
    width = values.shape[1]
    # Wide ramps are walked in longer steps: all of them take about as many.
    pace = max(1.0, sigma / STEPS_A_SIGMA)
    reach = ceil(5.0 * sigma / pace) + 1
    for y in range(first_row, last_row):
        for x in range(width):
            here = values[y, x]
            refined[y, x] = here
            across, down = _gradient(values, x, y)
            slope = sqrt(across * across + down * down)
            # Too flat to belong to an edge: most pixels end here.
            if not slope * 4 * reach * pace > least_edge:
                continue
            across, down = across / slope, down / slope
            # Where the ramp ends both ways; its height there.
            up, top, _, steepest_up, at_up = _walk(values, x, y, across, down, 1.0, reach, pace, PLATEAU_SIGMAS * sigma)
            back, bottom, _, steepest_down, at_down = _walk(
                values, x, y, across, down, -1.0, reach, pace, PLATEAU_SIGMAS * sigma
            )
            steepest = max(steepest_up, steepest_down)
            if top - bottom < least_edge:
                continue
            # The step was where the ramp is steepest (px up it from here); its plateaus lie some sigmas to both sides.
            edge = at_up if steepest_up >= steepest_down else -at_down
            up, back = min(up, edge + PLATEAU_SIGMAS * sigma), min(back, PLATEAU_SIGMAS * sigma - edge)
            top = _at(values, x + across * up, y + down * up)
            bottom = _at(values, x - across * back, y - down * back)
            # Higher than a step of this slope can be after a blur of sigma: a slanted surface.
            if not (least_edge <= top - bottom <= TOLERANCE * EDGE_SIGMAS * sigma * steepest):
                continue
            # Plateaus may be slanted: their slopes go on part of the way to here, but not past the value here.
            limit = MOST_EXTENSION * steepest
            top = max(_continue_plateau(values, x, y, across, down, up, top, limit), here)
            bottom = min(_continue_plateau(values, x, y, -across, -down, back, bottom, limit), here)
            if not top > bottom:
                continue

            # Where does this pixel belong? By its height on the ramp and by its colour in the photo, ...
            front = min(up, edge + COLOR_SIGMAS * sigma + 1)
            behind = min(back, COLOR_SIGMAS * sigma + 1 - edge)
            colour = _foreground_colour(photo, x, y, across, down, front, behind)
            # ... steepened about the middle of the ramp; softness near 0 makes a step.
            place = (here - bottom) / (top - bottom) - 0.5
            place = (place + COLOR_SHARE * (1.0 - softness) * colour) / softness + 0.5
            refined[y, x] = bottom + (top - bottom) * min(max(place, 0.0), 1.0)
