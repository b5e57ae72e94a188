"""Sharp depth edges from soft ones: pixels between foreground and background are given to one of them.

A soft map is a sharp one, blurred; the blur is measured on the map itself. Only ramps that such a blur makes of a step
become steps, so exact maps, slanted and curved surfaces stay unchanged. Then edge bands follow the photo's colours.
"""

from __future__ import annotations

from math import ceil, erfc, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.blur import (
    EDGE_SIGMAS,
    MAX_ENLARGED_SPREAD,
    MAX_SPREAD,
    SEARCHED_PX,
    extent,
    measure_edge_blur,
)
from iibr_core.depth.edges.fit import fit_to_blur
from iibr_core.depth.edges.labels import label_edges, step_distance
from iibr_core.depth.edges.line import FLAT_SHARE, GAUSSIAN_SIGMAS, PLATEAU_SIGMAS, gradient, height_at, passes, walk
from iibr_core.depth.edges.lone import fill_lone
from iibr_core.depth.guess import resize_picture
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.surfaces import EDGE_SHARE
from iibr_core.types import FloatImage, ImageSize, InputError, image_size

WIDE_SIGMA_PX, WORK_SIGMA_PX = 4.5, 2.0
"""Blur from which a map is sharpened at a smaller size, and its blur at that size, in pixels."""
RAMP_TOLERANCE = 2.0
"""Factor by which a ramp may be longer or shorter than the blur makes it: longer ones are surfaces, shorter exact."""
EXTENSION = 0.7
"""Share of a plateau's slope that continues under the ramp."""
MAX_EXTENSION = 0.05
"""Largest slope that continues under the ramp, as a share of the ramp's steepest slope."""
BEND = 2.0
"""Factor by which a surface bends away from the view faster at its edge than beyond the blur: round things do."""


def refine(
    photo: FloatImage,
    disparity: FloatImage,
    unknown: NDArray[np.bool_] | None = None,
    stages: Stages = ALL_STAGES,
    is_enlarged: bool = False,
) -> FloatImage:
    """Return the disparity with steps for soft depth edges, drawn to the photo's edges.

    photo: (H, W, 3), sRGB-encoded. disparity: (H, W), in any unit in which larger is closer; pixels that are not finite
    are filled by colour. unknown: (H, W), pixels that were filled like that before. stages: stages that are on.
    is_enlarged: whether the map was smaller and soft, so all its edges are blurred, though not all alike.
    Returns (H, W), within the range of the disparity but for the continuation of slopes. Exact maps keep their bits.
    Raises ValueError if the sizes differ, InputError if no disparity is known.
    """
    if photo.shape != (*disparity.shape, 3):
        raise ValueError(f"the photo is {photo.shape}, the disparity {disparity.shape}")
    colors = np.ascontiguousarray(photo, np.float32)
    holes = ~np.isfinite(disparity) if unknown is None else unknown | ~np.isfinite(disparity)
    values = _fill_unknown(colors, disparity)
    min_edge = EDGE_SHARE * extent(values)
    if not min_edge > 0:
        return values
    sharp = _sharpen(colors, values, min_edge, is_enlarged, stages) if stages.sharpen_soft_edges else values
    if stages.refill_between_surfaces:
        sharp, holes = fill_lone(colors, sharp, holes, min_edge)
    return label_edges(colors, sharp, holes, min_edge) if stages.label_edge_bands else sharp


def _fill_unknown(colors: FloatImage, disparity: FloatImage) -> FloatImage:
    known = np.where(np.isfinite(disparity), disparity, np.nan).astype(np.float32)
    if known.size and np.isnan(known).all():
        raise InputError("refining depth edges: no disparity is known; give another map")
    return fill_disparity_by_color(colors, known) if np.isnan(known).any() else known


def _sharpen(colors: FloatImage, values: FloatImage, min_edge: float, is_enlarged: bool, stages: Stages) -> FloatImage:
    """Return the map with steps for soft edges; the map itself if it is not blurred."""
    sigma = measure_edge_blur(colors, values, MAX_ENLARGED_SPREAD if is_enlarged else MAX_SPREAD)
    times = sigma / WORK_SIGMA_PX
    if sigma > WIDE_SIGMA_PX and min(values.shape) > 2 * SEARCHED_PX * times:
        return _sharpen_small(colors, values, times, min_edge, stages)
    if sigma == 0:
        return values
    sharp = _with_steps(values, sigma, min_edge)
    # Outlines of enlarged maps are coarse; those of filtered maps are better without the fit.
    return fit_to_blur(colors, values, sharp, sigma, min_edge) if is_enlarged and stages.fit_to_blur else sharp


def _sharpen_small(colors: FloatImage, values: FloatImage, times: float, min_edge: float, stages: Stages) -> FloatImage:
    """Return a widely blurred map, sharpened at a size that is so many times smaller and enlarged in steps of 2.

    After each step the edges follow the photo's colours.
    """
    height, width = values.shape
    size = ImageSize(round(height / times), round(width / times))
    photo, small = resize_picture(colors, size), resize_picture(values[..., None], size)[..., 0]
    sigma = measure_edge_blur(photo, small, MAX_ENLARGED_SPREAD)
    sharp = small
    if sigma > 0:
        sharp = _with_steps(small, sigma, min_edge)
        sharp = fit_to_blur(photo, small, sharp, sigma, min_edge) if stages.fit_to_blur else sharp
    while size != values.shape:
        sharp = label_edges(photo, sharp, np.zeros(size, np.bool_), min_edge)
        is_last = 2 * min(size) >= min(height, width)
        size = ImageSize(height, width) if is_last else ImageSize(2 * size.height, 2 * size.width)
        photo, sharp = resize_picture(colors, size), resample_surfaces(sharp, size)
    return sharp


def _with_steps(values: FloatImage, sigma: float, min_edge: float) -> FloatImage:
    """Return a map, blurred by sigma, with steps for its ramps."""
    # This blur makes no ramp that is flatter at its steepest, and none that is longer.
    slope, reach = min_edge / (RAMP_TOLERANCE * EDGE_SIGMAS * sigma), ceil(GAUSSIAN_SIGMAS * sigma)
    is_near = step_distance(values, slope / sqrt(2), reach, counts_slopes=True) <= reach
    sharp = values.copy()
    in_bands(
        lambda first, last: _steps_in_rows(values, is_near, min_edge, sigma, (first, last), sharp), image_size(values)
    )
    return sharp


@kernel
def _continued(values, x, y, along, far, sigma, share, limit):
    """Return the height at (x, y) of a surface that begins at a distance along the line, by a share of its slope."""
    across, down = along
    level = height_at(values, x + across * far, y + down * far)
    slope = (height_at(values, x + across * (far + sigma), y + down * (far + sigma)) - level) / sigma
    return level - share * far * min(max(slope, -limit), limit)


@kernel
def _tail(far, sigma):
    """Return the share of a blurred step that is missing at a distance from its middle."""
    return 0.5 * erfc(far / (sqrt(2.0) * sigma))


@kernel
def _step_value(values, x, y, across, down, sigma, min_edge):
    """Return a pixel's value on one of the two surfaces of a step along a unit direction; unchanged elsewhere."""
    here = values[y, x]
    # Wide ramps are walked in longer steps: all of them take about as many.
    pace = max(1.0, 0.5 * sigma)
    reach = ceil((PLATEAU_SIGMAS + GAUSSIAN_SIGMAS) * sigma / pace) + 1
    up, top, steepest_up, at_up = walk(values, x, y, across, down, 1.0, reach, pace, PLATEAU_SIGMAS * sigma)
    to_foot, bottom, steepest_down, at_down = walk(
        values, x, y, across, down, -1.0, reach, pace, PLATEAU_SIGMAS * sigma
    )
    if top - bottom < min_edge:
        return here
    # The step was where the ramp is steepest, at this distance up the ramp; its plateaus lie some sigmas to both sides.
    steepest, edge = (steepest_up, at_up) if steepest_up >= steepest_down else (steepest_down, -at_down)
    up, to_foot = min(up, edge + PLATEAU_SIGMAS * sigma), min(to_foot, PLATEAU_SIGMAS * sigma - edge)
    top = height_at(values, x + across * up, y + down * up)
    bottom = height_at(values, x - across * to_foot, y - down * to_foot)
    # Higher than a step of this slope can be after the blur: a slanted surface. Lower: an exact edge.
    height, expected = top - bottom, EDGE_SIGMAS * steepest * sigma
    if not max(min_edge, expected / RAMP_TOLERANCE) <= height <= RAMP_TOLERANCE * expected:
        return here
    # Surfaces continue to rise beyond the plateaus, or return to the middle on both sides.
    rise = height_at(values, x + across * (up + sigma), y + down * (up + sigma)) - top
    fall = bottom - height_at(values, x - across * (to_foot + sigma), y - down * (to_foot + sigma))
    if max(rise, fall) > 2 * FLAT_SHARE * steepest * sigma:
        return here
    middle, far = 0.5 * (top + bottom), 2 * GAUSSIAN_SIGMAS * sigma
    returns_up = passes(values, x, y, across, down, up, far + edge, -1.0, middle)
    returns_down = passes(values, x, y, -across, -down, to_foot, far - edge, 1.0, middle)
    if returns_up and returns_down:
        return here
    # Slopes of the plateaus continue part of the distance to the pixel, but not past its value.
    limit = MAX_EXTENSION * steepest
    top = max(_continued(values, x, y, (across, down), up, sigma, EXTENSION, limit), here)
    bottom = min(_continued(values, x, y, (-across, -down), to_foot, sigma, EXTENSION, limit), here)
    if not top > bottom:
        return here
    is_above = 2.0 * here >= top + bottom
    # The blur lowered the foreground and raised the background: give back what a step's tail and the map both allow.
    edge += (middle - height_at(values, x + across * edge, y + down * edge)) / steepest
    above, below, end = _tail(up - edge, sigma), _tail(to_foot + edge, sigma), GAUSSIAN_SIGMAS * sigma
    step, limit = height / (1.0 - above - below), BEND * limit
    if not returns_up:
        lost = _continued(values, x, y, (across, down), end + edge, sigma, BEND, limit) - top
        top += min(max(lost, 0.0), above * step)
    if not returns_down:
        left = bottom - _continued(values, x, y, (-across, -down), end - edge, sigma, BEND, limit)
        bottom -= min(max(left, 0.0), below * step)
    return top if is_above else bottom


@kernel
def _steps_in_rows(values, is_near, min_edge, sigma, rows, sharp):
    """Write rows [rows[0], rows[1]) of the sharp map. is_near (H, W): pixels that may belong to a ramp."""
    for y in range(rows[0], rows[1]):
        for x in range(values.shape[1]):
            if is_near[y, x]:
                across, down = gradient(values, x, y)
                slope = sqrt(across * across + down * down)
                if slope > 0:
                    sharp[y, x] = _step_value(values, x, y, across / slope, down / slope, sigma, min_edge)
