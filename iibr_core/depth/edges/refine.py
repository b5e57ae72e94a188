"""Sharp depth edges from soft ones: what lies between foreground and background is given to one of them.

A soft map is a sharp one, blurred; how much is measured on the map itself. Only slopes that such a blur
makes of a step or of something thin are changed, so exact maps, slanted and curved surfaces stay as they are.
"""

from __future__ import annotations

from math import ceil, erfc, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.blur_fit import fit_to_blur
from iibr_core.depth.edges.edge_band import resolve_edge_band
from iibr_core.depth.edges.edge_blur import (
    EDGE_SIGMAS,
    MOST_ENLARGED_SPREAD,
    MOST_SPREAD,
    STEEPEST_PLATEAU,
    extent,
    measure_edge_blur,
)
from iibr_core.depth.edges.edge_labels import step_distance
from iibr_core.depth.edges.edge_profiles import (
    GAUSSIAN_SIGMAS,
    PLATEAU_SIGMAS,
    RETURN_SIGMAS,
    SHARES,
    gradient,
    height_at,
    passes,
    structure_at,
    walk,
)
from iibr_core.depth.guess import resize_picture
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.surfaces import EDGE_SHARE
from iibr_core.types import (
    FloatImage,
    ImageSize,
    InputError,
    image_size,
)

WIDE_SIGMA_PX, WORK_SIGMA_PX = 4.5, 2.0
"""A map that is blurred by more than the first is sharpened at a size at which it is blurred by the second."""
LEAST_SMALL_SIDE_PX = 40
"""Of that size."""
RAMP_TOLERANCE = 2.0
"""By this factor a ramp may be longer or shorter than the blur makes it: longer ones are surfaces, shorter exact."""
EXTENSION = 0.7
"""How far the plateaus' own slopes are continued under the ramp: 1 = all the way."""
MOST_EXTENSION = 0.05
"""Limit on those slopes, relative to the ramp's steepest."""
BEND = 2.0
"""How much faster than beyond its blur a surface bends away from the view at the edge itself: round things do."""
RAMP_SIGMAS = PLATEAU_SIGMAS + GAUSSIAN_SIGMAS
"""From a pixel to the ends of its ramp, at most."""


def refine(
    photo: FloatImage,
    disparity: FloatImage,
    strength: float = 1.0,
    unknown: NDArray[np.bool_] | None = None,
    stages: Stages = ALL_STAGES,
    is_enlarged: bool = False,
) -> FloatImage:
    """The disparity with its soft edges snapped to the photo's edges; no values between foreground and background.

    photo: (H, W, 3), sRGB-encoded. disparity: (H, W), any unit in which larger is closer; what is not finite is filled
    by what looks like it beside it. strength: 0 changes nothing, 1 makes steps; between them the map lies between both.
    unknown: (H, W), what was filled like that before; None: nothing. stages: that are on. is_enlarged: the map was
    smaller and soft, so all its edges are blurred, though not all alike.
    Returns (H, W) float32, within the range of what was given but for a slope's continuation and for what is thin: that
    gets the height back which the blur took. Where nothing says that the map is blurred, its bits are those given, but
    in the edge bands of depth edges (`resolve_edge_band`).
    Raises ValueError if the sizes differ, InputError if strength is not within 0..1 or no disparity is known.
    """
    if photo.shape != (*disparity.shape, 3):
        raise ValueError(f"the photo is {photo.shape}, the disparity {disparity.shape}")
    if not 0 <= strength <= 1:
        raise InputError(f"refinement strength {strength}: give a number from 0 (off) to 1")
    colors = np.ascontiguousarray(photo, np.float32)
    values = _fill_unknown(colors, disparity)
    least_edge = EDGE_SHARE * extent(values)
    if strength == 0 or not least_edge > 0:
        return values
    filled = ~np.isfinite(disparity) if unknown is None else unknown | ~np.isfinite(disparity)
    most_spread = MOST_ENLARGED_SPREAD if is_enlarged else MOST_SPREAD
    sigma = measure_edge_blur(colors, values, most_spread) if stages.sharpen_soft_edges else 0.0
    if sigma > WIDE_SIGMA_PX and min(values.shape) > LEAST_SMALL_SIDE_PX * sigma / WORK_SIGMA_PX:
        sharp = _sharpen_small(colors, values, sigma / WORK_SIGMA_PX, least_edge, stages)
    else:
        sharp = _sharpen(colors, values, sigma, least_edge, stages)
    refined = resolve_edge_band(colors, sharp, least_edge, filled, stages)
    return refined if strength == 1 else values + np.float32(strength) * (refined - values)


def _sharpen_small(
    colors: FloatImage, values: FloatImage, times: float, least_edge: float, stages: Stages
) -> FloatImage:
    """A widely blurred map, sharpened at a size at which its blur is narrow, and enlarged again in steps, in each of
    which its edges follow the photo's. times: how much smaller.
    """
    height, width = values.shape
    size = ImageSize(round(height / times), round(width / times))
    photo, small = resize_picture(colors, size), resize_picture(values[..., None], size)[..., 0]
    sigma = measure_edge_blur(photo, small, MOST_ENLARGED_SPREAD)
    sharp = _sharpen(photo, small, sigma, least_edge, stages)
    while size != values.shape:
        nothing = np.zeros(size, np.bool_)
        sharp = resolve_edge_band(photo, sharp, least_edge, nothing, stages)
        is_last = 2 * min(size) >= min(height, width)
        size = ImageSize(height, width) if is_last else ImageSize(2 * size.height, 2 * size.width)
        photo, sharp = resize_picture(colors, size), resample_surfaces(sharp, size)
    return sharp


def _sharpen(colors: FloatImage, values: FloatImage, sigma: float, least_edge: float, stages: Stages) -> FloatImage:
    """The map with its soft edges snapped to the photo's; its bits where nothing says that it is blurred."""
    if sigma == 0:
        return values
    # No ramp that this blur made of an edge is flatter at its steepest, and none is longer.
    slope, reach = least_edge / (RAMP_TOLERANCE * EDGE_SIGMAS * sigma), ceil(GAUSSIAN_SIGMAS * sigma)
    is_near = step_distance(values, slope / sqrt(2), reach, counts_slopes=True) <= reach
    refined = values.copy()
    in_bands(
        lambda first, last: _refine(values, colors, is_near, least_edge, sigma, first, last, refined),
        image_size(values),
    )
    return fit_to_blur(colors, values, refined, sigma, least_edge) if stages.fit_to_blur else refined


def _fill_unknown(colors: FloatImage, disparity: FloatImage) -> FloatImage:
    known = np.where(np.isfinite(disparity), disparity, np.nan).astype(np.float32)
    if known.size and np.isnan(known).all():
        raise InputError("refining depth edges: no disparity is known; give another map")
    return fill_disparity_by_color(colors, known) if np.isnan(known).any() else known


@kernel
def _continued(values, x, y, across, down, far, sigma, share, limit):
    """The height at (x, y) of a surface that begins `far` away along the direction, by a share of its slope there."""
    level = height_at(values, x + across * far, y + down * far)
    slope = (height_at(values, x + across * (far + sigma), y + down * (far + sigma)) - level) / sigma
    return level - share * far * min(max(slope, -limit), limit)


@kernel
def _tail(far, sigma):
    """Share of a step, blurred by sigma, that is not reached yet so far from its middle."""
    return 0.5 * erfc(far / (sqrt(2.0) * sigma))


@kernel
def _curvature(values, x, y, apart):
    """The map's strongest second derivative at a pixel and its direction (x, y), from pixels so far apart."""
    height, width = values.shape
    left, right, above, below = (
        max(x - apart, 0),
        min(x + apart, width - 1),
        max(y - apart, 0),
        min(y + apart, height - 1),
    )
    here, area = values[y, x], 1.0 * apart * apart
    xx = (values[y, left] - 2.0 * here + values[y, right]) / area
    yy = (values[above, x] - 2.0 * here + values[below, x]) / area
    xy = (values[above, left] + values[below, right] - values[above, right] - values[below, left]) / (4.0 * area)
    mean, half = 0.5 * (xx + yy), sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    strongest = mean + half if mean >= 0 else mean - half
    # Of the two ways to write an eigenvector the longer one.
    across, down = (strongest - yy, xy) if abs(strongest - yy) >= abs(strongest - xx) else (xy, strongest - xx)
    length = sqrt(across * across + down * down)
    if not length > 0:
        return 0.0, 1.0, 0.0
    return strongest, across / length, down / length


@kernel
def _as_crest(values, photo, x, y, across, down, sigma, least_edge, shares, taps):
    """The pixel's value on or near the crest of a ridge or slit, or beside it; NaN where there is none. (across, down):
    its slope.
    """
    apart = max(int(sigma + 0.5), 1)
    bend, line_x, line_y = _curvature(values, x, y, apart)
    # Too far from where it is level.
    along = across * line_x + down * line_y
    if not abs(along) < abs(bend) * apart:
        return np.nan
    sign, far = 1.0 if bend < 0 else -1.0, -along / bend
    height, ground, share = structure_at(
        values, photo, x, y, line_x, line_y, far, sign, sigma, least_edge, shares, taps
    )
    if height == 0:
        return np.nan
    return ground + height if share >= 0.5 else ground


@kernel
def _as_step(values, x, y, across, down, sigma, least_edge):
    """The pixel's value as part of one of the two surfaces of a step along the (unit) direction; as given elsewhere."""
    here = values[y, x]
    # Wide ramps are walked in longer steps: all of them take about as many.
    pace = max(1.0, 0.5 * sigma)
    reach = ceil(RAMP_SIGMAS * sigma / pace) + 1
    # Where the ramp ends both ways; its height there.
    up, top, steepest_up, at_up = walk(values, x, y, across, down, 1.0, reach, pace, PLATEAU_SIGMAS * sigma)
    to_foot, bottom, steepest_down, at_down = walk(
        values, x, y, across, down, -1.0, reach, pace, PLATEAU_SIGMAS * sigma
    )
    if top - bottom < least_edge:
        return here
    # The step was where the ramp is steepest (px up it from here); its plateaus lie some sigmas to both sides.
    steepest = max(steepest_up, steepest_down)
    edge = at_up if steepest_up >= steepest_down else -at_down
    up, to_foot = min(up, edge + PLATEAU_SIGMAS * sigma), min(to_foot, PLATEAU_SIGMAS * sigma - edge)
    top = height_at(values, x + across * up, y + down * up)
    bottom = height_at(values, x - across * to_foot, y - down * to_foot)
    # Higher than a step of this slope can be after a blur of sigma: a slanted surface. Lower: an exact edge.
    unit = EDGE_SIGMAS * steepest
    if not (max(least_edge, sigma * unit / RAMP_TOLERANCE) <= top - bottom <= RAMP_TOLERANCE * sigma * unit):
        return here
    # Where it goes on rising so far from its middle, or comes back to it on both sides, it is a surface.
    rise = height_at(values, x + across * (up + sigma), y + down * (up + sigma)) - top
    fall = bottom - height_at(values, x - across * (to_foot + sigma), y - down * (to_foot + sigma))
    if max(rise, fall) > STEEPEST_PLATEAU * steepest * sigma:
        return here
    middle, height, returns = 0.5 * (top + bottom), top - bottom, RETURN_SIGMAS * sigma
    returns_up = passes(values, x, y, across, down, up, returns + edge, -1.0, middle)
    returns_down = passes(values, x, y, -across, -down, to_foot, returns - edge, 1.0, middle)
    if returns_up and returns_down:
        return here
    # Plateaus may be slanted: their slopes go on part of the way to here, but not past the value here.
    limit = MOST_EXTENSION * steepest
    top = max(_continued(values, x, y, across, down, up, sigma, EXTENSION, limit), here)
    bottom = min(_continued(values, x, y, -across, -down, to_foot, sigma, EXTENSION, limit), here)
    if not top > bottom:
        return here
    is_above = 2.0 * here >= top + bottom
    # Beside the edge, the blur took from the foreground and left on the background: as the map shows.
    edge += (middle - height_at(values, x + across * edge, y + down * edge)) / steepest
    above, below, end = _tail(up - edge, sigma), _tail(to_foot + edge, sigma), GAUSSIAN_SIGMAS * sigma
    step, limit = height / (1.0 - above - below), BEND * limit
    if not returns_up:
        lost = _continued(values, x, y, across, down, end + edge, sigma, BEND, limit) - top
        top += min(max(lost, 0.0), above * step)
    if not returns_down:
        left = bottom - _continued(values, x, y, -across, -down, end - edge, sigma, BEND, limit)
        bottom -= min(max(left, 0.0), below * step)
    return top if is_above else bottom


@kernel
def _refine(values, photo, is_near, least_edge, sigma, first_row, last_row, refined):
    """Rows [first_row, last_row) of the refined map. is_near (H, W): which pixels may belong to a ramp."""
    shares, taps = np.empty(SHARES), np.empty(SHARES)
    for y in range(first_row, last_row):
        for x in range(values.shape[1]):
            if not is_near[y, x]:
                continue
            across, down = gradient(values, x, y)
            crest = _as_crest(values, photo, x, y, across, down, sigma, least_edge, shares, taps)
            slope = sqrt(across * across + down * down)
            if crest == crest:
                refined[y, x] = crest
            elif slope > 0:
                refined[y, x] = _as_step(values, x, y, across / slope, down / slope, sigma, least_edge)
