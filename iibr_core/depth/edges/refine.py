"""Sharp depth edges from soft ones: what lies between foreground and background is given to one of them.

A soft map is a sharp one, blurred; how much is measured on the map itself, place by place. Only slopes that such a blur
makes of a step or of something thin are changed, so exact maps, slanted and curved surfaces stay as they are.
"""

from __future__ import annotations

from math import ceil, erfc, floor, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.blur_fit import fit_to_blur
from iibr_core.depth.edges.edge_band import resolve_edge_band
from iibr_core.depth.edges.edge_blur import EDGE_SIGMAS, SHARP_PX, extent, measure_edge_blur
from iibr_core.depth.edges.edge_profiles import gradient, height_at, walk
from iibr_core.depth.edges.ridges import SHARES, structure_at
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import FloatImage, InputError, image_size

LEAST_EDGE = 0.03
"""Lower steps are left alone: share of the map's range."""
TOLERANCE = 1.5
"""A ramp may be longer than the blur makes it by this factor; longer ones are surfaces."""
STEEPEST_END = 0.4
"""Of a ramp's steepest slope, at its ends."""
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
TAIL_SIGMAS = 3.0
"""From a step's middle to where its blur ends: what the map rises up to there is the step's, within what a Gaussian
leaves there."""
MOST_TAIL = 0.2
"""Of a step: its middle is only known to a part of a pixel."""
BEND = 2.0
"""How much faster than beyond its blur a surface bends away from the view at the edge itself: round things do."""
STEPS_A_SIGMA = 2.5
"""Ramps are walked in steps so fine, or of a pixel."""
RAMP_SIGMAS = 5.0
"""From a pixel to the ends of its ramp, at most."""
FLAT_EDGE_SHARE = 0.2
"""Of the least edge, up to which a map is flat."""
CREST_SHARE = 0.5
"""Of the least edge that the map falls beside a crest, from which it may be one."""
FINE_STRENGTH = 1e-3


def refine(
    photo: FloatImage,
    disparity: FloatImage,
    strength: float = 1.0,
    unknown: NDArray[np.bool_] | None = None,
    should_stop: ShouldStop = never,
    stages: Stages = ALL_STAGES,
) -> FloatImage:
    """The disparity with its soft edges snapped to the photo's edges; no values between foreground and background.

    photo: (H, W, 3), sRGB-encoded. disparity: (H, W), any unit in which larger is closer; what is not finite is filled
    by what looks like it beside it. strength: 0 changes nothing, 1 makes steps, between them the slopes are shortened.
    unknown: (H, W), what was filled like that before; None: nothing. stages: that are on.
    Returns (H, W) float32, within the range of what was given but for a slope's continuation and for what is thin: that
    gets the height back which the blur took. Where nothing says that the map is blurred, its bits are those given, but
    in the edge bands of depth edges (`resolve_edge_band`).
    Raises ValueError if the sizes differ, InputError if strength is not within 0..1 or no disparity is known, Cancelled
    once should_stop is true.
    """
    if photo.shape != (*disparity.shape, 3):
        raise ValueError(f"the photo is {photo.shape}, the disparity {disparity.shape}")
    if not 0 <= strength <= 1:
        raise InputError(f"refinement strength {strength}: give a number from 0 (off) to 1")
    colors = np.ascontiguousarray(photo, np.float32)
    values = _fill_unknown(colors, disparity, should_stop)
    if strength == 0:
        return values
    least_edge, softness = LEAST_EDGE * extent(values), max(1.0 - strength, FINE_STRENGTH)
    sharp, soft = _sharpen(colors, values, least_edge, softness, should_stop, stages)
    if not least_edge > 0:
        return sharp
    filled = ~np.isfinite(disparity) if unknown is None else unknown | ~np.isfinite(disparity)
    resolved = resolve_edge_band(colors, sharp, least_edge, filled, soft, should_stop, stages)
    # Edge bands, too, go so far only.
    return resolved if strength == 1 else sharp + np.float32(strength) * (resolved - sharp)


def _sharpen(
    colors: FloatImage,
    values: FloatImage,
    least_edge: float,
    softness: float,
    should_stop: ShouldStop,
    stages: Stages,
) -> tuple[FloatImage, NDArray[np.bool_] | None]:
    """The map with its soft edges snapped to the photo's, its bits where nothing says that it is blurred; and where
    that is said (H, W), None: nowhere.
    """
    if not stages.sharpen_soft_edges:
        return values, None
    blur = measure_edge_blur(colors, values, should_stop)
    if not blur.sigma_px.any():
        return values, None
    refined = np.empty_like(values)

    def band(first: int, last: int) -> None:
        _refine(values, colors, least_edge, blur.sigma_px, blur.cell_px, softness, first, last, refined)

    in_bands(band, image_size(values), should_stop)
    # Slopes that are only shortened give no map that this could be the blur of.
    if stages.fit_to_blur and softness == FINE_STRENGTH:
        refined = fit_to_blur(colors, values, refined, blur, least_edge, should_stop)
    return refined, blur.at_pixels(blur.sigma_px > 0, image_size(values))


def _fill_unknown(colors: FloatImage, disparity: FloatImage, should_stop: ShouldStop) -> FloatImage:
    known = np.where(np.isfinite(disparity), disparity, np.nan).astype(np.float32)
    if known.size and np.isnan(known).all():
        raise InputError("refining depth edges: no disparity is known; give another map")
    return fill_disparity_by_color(colors, known, should_stop) if np.isnan(known).any() else known


@kernel
def _continue_plateau(values, x, y, across, down, length, level, limit):
    """The height at (x, y) of a plateau that begins `length` away at `level`, from its slope over two pixels there."""
    far = length + 2
    slope = (height_at(values, x + across * far, y + down * far) - level) / 2
    return level - EXTENSION * length * min(max(slope, -limit), limit)


@kernel
def _beyond_blur(values, x, y, across, down, far, sigma, limit):
    """The height at (x, y) of a plateau, from where the blur of its edge ends, `far` away, and its slope there."""
    level = height_at(values, x + across * far, y + down * far)
    slope = (height_at(values, x + across * (far + sigma), y + down * (far + sigma)) - level) / sigma
    return level - BEND * far * min(max(slope, -limit), limit)


@kernel
def _tail(far, sigma):
    """Share of a step, blurred by sigma, that is not reached yet so far from its middle."""
    return min(0.5 * erfc(far / (sqrt(2.0) * sigma)), MOST_TAIL)


@kernel
def _foreground_colour(photo, x, y, across, down, foreground, behind):
    """Matting: a colour between those so far away; -0.5 background .. 0.5 foreground, nearer 0 the less sure."""
    height, width = photo.shape[:2]
    # Pixels of both surfaces, beyond the ramp.
    foreground_x = min(max(floor(x + across * foreground + 0.5), 0), width - 1)
    foreground_y = min(max(floor(y + down * foreground + 0.5), 0), height - 1)
    background_x = min(max(floor(x - across * behind + 0.5), 0), width - 1)
    background_y = min(max(floor(y - down * behind + 0.5), 0), height - 1)
    # Matting: where the colour lies on the line between theirs, how far apart they are, how far off it is.
    along = contrast = away = 0.0
    for c in range(3):
        background = photo[background_y, background_x, c]
        difference = photo[foreground_y, foreground_x, c] - background
        own = photo[y, x, c] - background
        along, contrast, away = along + own * difference, contrast + difference**2, away + own**2
    share = along / max(contrast, 1e-9)
    # Sure where both surfaces differ by more than noise and the colour lies on the line.
    residual = max(away - share * along, 0.0)
    return (min(max(share, 0.0), 1.0) - 0.5) * contrast / (contrast + residual + COLOR_NOISE)


@kernel
def _is_flat(values, x, y, apart, least):
    """Whether the map is as high as at a pixel on all four sides of it, so many pixels away."""
    height, width = values.shape
    here = values[y, x]
    across = max(abs(values[y, max(x - apart, 0)] - here), abs(values[y, min(x + apart, width - 1)] - here))
    down = max(abs(values[max(y - apart, 0), x] - here), abs(values[min(y + apart, height - 1), x] - here))
    return max(across, down) < least


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
def _as_structure(values, photo, x, y, across, down, far, sign, sigma, least_edge, softness, shares, taps):
    """The pixel's value as part of a ridge (sign 1) or slit (-1), or of what is beside it; NaN where there is none."""
    height, ground, share = structure_at(values, photo, x, y, across, down, far, sign, sigma, least_edge, shares, taps)
    if height == 0:
        return np.nan
    sharp = ground + height if share >= 0.5 else ground
    return values[y, x] + (1.0 - softness) * (sharp - values[y, x])


@kernel
def _as_crest(values, photo, x, y, across, down, sigma, least_edge, softness, shares, taps):
    """The pixel's value on or near the crest of a ridge or slit; NaN where there is none. (across, down): its slope."""
    apart = max(int(sigma + 0.5), 1)
    bend, line_x, line_y = _curvature(values, x, y, apart)
    # Too straight to be lower by an edge beside it, or too far from where it is level.
    along = across * line_x + down * line_y
    if not (abs(bend) * apart * apart >= CREST_SHARE * least_edge and abs(along) < abs(bend) * apart):
        return np.nan
    sign = 1.0 if bend < 0 else -1.0
    far = -along / bend
    return _as_structure(values, photo, x, y, line_x, line_y, far, sign, sigma, least_edge, softness, shares, taps)


@kernel
def _as_step(values, photo, x, y, across, down, sigma, least_edge, softness, shares, taps):
    """The pixel's value as part of one of the two surfaces of a step along the (unit) direction; as given elsewhere."""
    here = values[y, x]
    # Wide ramps are walked in longer steps: all of them take about as many.
    pace = max(1.0, sigma / STEPS_A_SIGMA)
    reach = ceil(RAMP_SIGMAS * sigma / pace) + 1
    # Where the ramp ends both ways; its height there.
    up, top, end_up, steepest_up, at_up = walk(values, x, y, across, down, 1.0, reach, pace, PLATEAU_SIGMAS * sigma)
    to_foot, bottom, end_down, steepest_down, at_down = walk(
        values, x, y, across, down, -1.0, reach, pace, PLATEAU_SIGMAS * sigma
    )
    steepest = max(steepest_up, steepest_down)
    # Where it still rises like this so far from its middle, it is a surface.
    if top - bottom < least_edge or max(end_up, end_down) > STEEPEST_END * steepest:
        return here
    # The step was where the ramp is steepest (px up it from here); its plateaus lie some sigmas to both sides.
    edge = at_up if steepest_up >= steepest_down else -at_down
    up, to_foot = min(up, edge + PLATEAU_SIGMAS * sigma), min(to_foot, PLATEAU_SIGMAS * sigma - edge)
    top = height_at(values, x + across * up, y + down * up)
    bottom = height_at(values, x - across * to_foot, y - down * to_foot)
    # Higher than a step of this slope can be after a blur of sigma: a slanted surface. Lower: an exact edge.
    unit = EDGE_SIGMAS * steepest
    if not (max(least_edge, SHARP_PX * unit) <= top - bottom <= TOLERANCE * sigma * unit):
        return here
    # Where the map returns to the other side's height as soon as it can, there is no plateau, but something thin.
    middle, height = 0.5 * (top + bottom), top - bottom
    beyond, before = 2 * up - edge + PLATEAU_SIGMAS * sigma, 2 * to_foot + edge + PLATEAU_SIGMAS * sigma
    if height_at(values, x + across * beyond, y + down * beyond) < middle:
        value = _as_structure(values, photo, x, y, across, down, up, 1.0, sigma, least_edge, softness, shares, taps)
        if value == value:
            return value
    if height_at(values, x - across * before, y - down * before) > middle:
        value = _as_structure(
            values, photo, x, y, across, down, -to_foot, -1.0, sigma, least_edge, softness, shares, taps
        )
        if value == value:
            return value
    # Plateaus may be slanted: their slopes go on part of the way to here, but not past the value here.
    limit = MOST_EXTENSION * steepest
    top = max(_continue_plateau(values, x, y, across, down, up, top, limit), here)
    bottom = min(_continue_plateau(values, x, y, -across, -down, to_foot, bottom, limit), here)
    if not top > bottom:
        return here

    # Where does this pixel belong? By its height on the ramp and by its colour in the photo, ...
    foreground = min(up, edge + COLOR_SIGMAS * sigma + 1)
    behind = min(to_foot, COLOR_SIGMAS * sigma + 1 - edge)
    colour = _foreground_colour(photo, x, y, across, down, foreground, behind)
    # ... steepened about the middle of the ramp; softness near 0 makes a step.
    place = (here - bottom) / (top - bottom) - 0.5
    place = (place + COLOR_SHARE * (1.0 - softness) * colour) / softness + 0.5
    # Beside the edge, the blur took from the foreground and left on the background: as the map shows.
    edge += (middle - height_at(values, x + across * edge, y + down * edge)) / steepest
    above, below, end = _tail(up - edge, sigma), _tail(to_foot + edge, sigma), TAIL_SIGMAS * sigma
    step, limit = (1.0 - softness) * height / (1.0 - above - below), BEND * limit
    lost = _beyond_blur(values, x, y, across, down, end + edge, sigma, limit) - top
    left = bottom - _beyond_blur(values, x, y, -across, -down, end - edge, sigma, limit)
    top, bottom = top + min(max(lost, 0.0), above * step), bottom - min(max(left, 0.0), below * step)
    return bottom + (top - bottom) * min(max(place, 0.0), 1.0)


@kernel
def _refine(values, photo, least_edge, sigmas, cell, softness, first_row, last_row, refined):
    """Rows [first_row, last_row) of the refined map. softness: 0 = steps, 1 = as given."""
    width = values.shape[1]
    shares, taps = np.empty(SHARES), np.empty(SHARES)
    for y in range(first_row, last_row):
        for x in range(width):
            refined[y, x] = values[y, x]
            sigma = sigmas[y // cell, x // cell]
            # Exact edges here, or none: most pixels end here.
            if sigma == 0 or _is_flat(values, x, y, int(PLATEAU_SIGMAS * sigma), FLAT_EDGE_SHARE * least_edge):
                continue
            across, down = gradient(values, x, y)
            crest = _as_crest(values, photo, x, y, across, down, sigma, least_edge, softness, shares, taps)
            if crest == crest:
                refined[y, x] = crest
                continue
            slope = sqrt(across * across + down * down)
            # Too flat to belong to an edge.
            if slope * 4 * (RAMP_SIGMAS * sigma + 1) > least_edge:
                refined[y, x] = _as_step(
                    values, photo, x, y, across / slope, down / slope, sigma, least_edge, softness, shares, taps
                )
