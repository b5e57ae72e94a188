"""A disparity map and its photo along a line across an edge: heights, slopes, where the photo changes; and thin
structures there: how high a wire or a slit was before the blur, by its width in the photo.

A blur of the map lowers what is narrower than itself and leaves its volume: the photo knows the width, so the height
follows. It counts only where the structure so found, blurred again, gives the map that was given.
"""

from __future__ import annotations

from math import ceil, exp, floor, sqrt

import numpy as np

from iibr_core.runtime.kernels import kernel

GAUSSIAN_SIGMAS = 3.0
"""Where a Gaussian ends."""
PLATEAU_SIGMAS = 2.0
"""From the middle of a blurred step, or from where a blurred structure ended, to the plateaus beside it."""
FLAT_SHARE = 0.15
"""What changes by no more than this share of a step beside it is flat."""
COLOR_NOISE = 0.003
"""Squared distance of colours (sRGB-encoded) that tells nothing."""
FLATNESS = 0.08
"""A ramp ends where its slope falls below this share of its steepest."""
SAMPLES_A_PX = 2
"""Of the photo along the line across a structure."""
WIDEST_SIGMAS = 2 * PLATEAU_SIGMAS
"""A structure wider than that has a crest as high as it was."""
LEAST_CREST_HEIGHT = 0.25
"""Of a structure's height, after the blur: lower ones are guesses."""
MOST_CREST_MISFIT = 0.05
"""Deviation (rms) of the structure, blurred again, from the given map, relative to its height there."""
RETURN_SIGMAS = 2 * GAUSSIAN_SIGMAS
"""What rises again on both sides within so much of its middle, be it a step or a crest, is a relief."""
SEARCHED_PX = 20
"""How far from a step or a crest map and photo are looked at, at most."""
SHARES = 2 * SEARCHED_PX * SAMPLES_A_PX + 1
"""Places looked at."""
LEAST_SIDE_HEIGHT = 0.5
"""A crest's height over its higher side, relative to that over its lower one, from which it is no step."""
BLURS = 0.65 * 1.15 ** np.arange(16)
"""Tried (sigma, px) where the blur of a map is measured on a structure."""


@kernel
def height_at(values, x, y):
    """The map at a real position, bilinear; its border pixels continue outside."""
    height, width = values.shape
    # The last cell of pixels is used up to its far end: both taps exist even there.
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    left, top = min(int(x), width - 2), min(int(y), height - 2)
    u, v = x - left, y - top
    # Unsigned indices need no test for counting from the end.
    left, top = np.uint64(left), np.uint64(top)
    right, under = left + np.uint64(1), top + np.uint64(1)
    above = values[top, left] * (1.0 - u) + values[top, right] * u
    below = values[under, left] * (1.0 - u) + values[under, right] * u
    return above * (1.0 - v) + below * v


@kernel
def is_inside(values, x, y):
    """Whether a real position lies between the centres of the map's outermost pixels."""
    return 0 <= x <= values.shape[1] - 1 and 0 <= y <= values.shape[0] - 1


@kernel
def passes(values, x, y, across, down, near, far, sign, level):
    """Whether the map is above (sign 1) or below (-1) a level somewhere between these distances from (x, y); outside
    the map it may be.
    """
    if not is_inside(values, x + across * far, y + down * far):
        return True
    for k in range(ceil(far - near) + 1):
        at = min(near + k, far)
        if sign * (height_at(values, x + across * at, y + down * at) - level) > 0:
            return True
    return False


@kernel
def gradient(values, x, y):
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
def walk(values, x, y, across, down, sign, reach, pace, beyond):
    """From (x, y) up (sign 1) or down (-1) the ramp: (length, value at its end, steepest slope, where).

    reach: at most so many steps; pace: of so many pixels; beyond: no farther than that past the steepest place, px.
    """
    before, steepest, last, steepest_at = height_at(values, x, y), 0.0, 0.0, 0.0
    # A march along the gradient, one sample a step.
    for k in range(1, reach + 1):
        far = sign * k * pace
        value = height_at(values, x + far * across, y + far * down)
        # Rise a pixel since the last sample, positive both ways along the ramp.
        slope = (value - before) * sign / pace
        levelled = slope < 0.5 * steepest and slope > 0.85 * last
        # The plateau: nearly flat, or no longer rising, or levelled off on a slanted surface, or too far past the edge.
        if slope <= FLATNESS * steepest or slope <= 0 or levelled or (k - 1) * pace > steepest_at + beyond:
            return (k - 1) * pace, before, steepest, steepest_at
        if slope > steepest:
            steepest, steepest_at = slope, (k - 0.5) * pace
        last, before = slope, value
    return reach * pace, before, steepest, steepest_at


@kernel
def strongest_change(photo, x, y, across, down, first, last):
    """Greatest squared change of the photo's colour over 2 px of the line through (x, y), between those distances."""
    height, width = photo.shape[:2]
    strongest = 0.0
    for k in range(floor(last - first) + 1):
        at = first + k
        # The pixels nearest to one pixel before and one after.
        x0 = min(max(floor(x + across * (at - 1) + 0.5), 0), width - 1)
        y0 = min(max(floor(y + down * (at - 1) + 0.5), 0), height - 1)
        x1 = min(max(floor(x + across * (at + 1) + 0.5), 0), width - 1)
        y1 = min(max(floor(y + down * (at + 1) + 0.5), 0), height - 1)
        change = 0.0
        for c in range(3):
            change += (photo[y1, x1, c] - photo[y0, x0, c]) ** 2
        strongest = max(strongest, change)
    return strongest


@kernel
def _color_at(photo, x, y):
    """The photo's colour at a real position, bilinear."""
    height, width = photo.shape[:2]
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    u, v = x - int(x), y - int(y)
    # Unsigned indices need no test for counting from the end.
    left, right = np.uint64(x), np.uint64(min(int(x) + 1, width - 1))
    top, bottom = np.uint64(y), np.uint64(min(int(y) + 1, height - 1))
    a, b, c, d = (1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v
    red = a * photo[top, left, 0] + b * photo[top, right, 0] + c * photo[bottom, left, 0] + d * photo[bottom, right, 0]
    green = (
        a * photo[top, left, 1] + b * photo[top, right, 1] + c * photo[bottom, left, 1] + d * photo[bottom, right, 1]
    )
    blue = a * photo[top, left, 2] + b * photo[top, right, 2] + c * photo[bottom, left, 2] + d * photo[bottom, right, 2]
    return red, green, blue


@kernel
def _product(a, b, origin):
    """Scalar product of two colours, seen from a third."""
    total = 0.0
    for c in range(3):
        total += (a[c] - origin[c]) * (b[c] - origin[c])
    return total


@kernel
def _structure_shares(photo, x, y, across, down, feet, widest, shares):
    """How much of a structure each place of the line across its crest (x, y) shows, by its colour, into shares (N,).

    Place k lies (k - N // 2) / SAMPLES_A_PX px from the crest; feet: where what is beside the structure begins on
    both sides, px. Returns first and last place that show any of it; last < first where the photo has no outline of it,
    or one of more than so many px.
    """
    before = _color_at(photo, x - across * feet[0], y - down * feet[0])
    after = _color_at(photo, x + across * feet[1], y + down * feet[1])
    # The structure's own colour: near its crest, where it differs most from both.
    own, own_at, most = before, 0, 0.0
    for k in range(-2, 3):
        color = _color_at(photo, x + across * k / SAMPLES_A_PX, y + down * k / SAMPLES_A_PX)
        contrast = min(_product(color, color, before), _product(color, color, after))
        if contrast > most:
            own, own_at, most = color, k, contrast
    if most < COLOR_NOISE:
        return 1, 0
    shares[:] = 0.0
    middle = len(shares) // 2
    first = last = middle + own_at
    for side in (-1, 1):
        beside = before if side < 0 else after
        whole = _product(own, own, beside)
        k = middle + own_at
        # Outwards, as long as there is any of it.
        while 0 <= k < len(shares):
            at = (k - middle) / SAMPLES_A_PX
            along = _product(_color_at(photo, x + across * at, y + down * at), own, beside)
            # Texture beside it and in it is neither a little of it nor a gap.
            share = min(max(2.0 * along / whole - 0.5, 0.0), 1.0)
            if share == 0:
                break
            shares[k] = share
            first, last = min(first, k), max(last, k)
            if last - first > widest * SAMPLES_A_PX:
                return 1, 0
            k += side
    if first == 0 or last == len(shares) - 1:
        return 1, 0
    return first, last


@kernel
def _fit_structure(values, x, y, across, down, shares, first, last, sigma, taps):
    """Height of a structure over a slanted ground, so that its blur by sigma fits the map: (height, ground, slope,
    misfit). ground and its slope at (x, y), along the line; misfit inf where it cannot be told.
    """
    middle, crest = len(shares) // 2, height_at(values, x, y)
    spacing = 1.0 / SAMPLES_A_PX
    begin = floor((first - middle) * spacing - PLATEAU_SIGMAS * sigma)
    end = ceil((last - middle) * spacing + PLATEAU_SIGMAS * sigma)
    # The blur, by distance in places.
    scale = spacing / (sqrt(2.0 * np.pi) * sigma)
    reach = min(int(GAUSSIAN_SIGMAS * sigma * SAMPLES_A_PX) + 1, len(taps))
    for k in range(reach):
        taps[k] = scale * exp(-0.5 * (k * spacing / sigma) ** 2)
    # Least squares for ground + slope * t + height * blurred(t).
    n = t1 = t2 = b0 = b1 = b2 = p0 = p1 = pb = pp = strongest = 0.0
    for t in range(begin, end + 1, max(int(sigma / 2.0), 1)):
        blurred = 0.0
        place = middle + t * SAMPLES_A_PX
        for k in range(max(first, place - reach + 1), min(last, place + reach - 1) + 1):
            blurred += shares[k] * taps[abs(k - place)]
        value = height_at(values, x + across * t, y + down * t) - crest
        n, t1, t2 = n + 1.0, t1 + t, t2 + t * t
        b0, b1, b2 = b0 + blurred, b1 + blurred * t, b2 + blurred * blurred
        p0, p1, pb, pp = p0 + value, p1 + value * t, pb + value * blurred, pp + value * value
        strongest = max(strongest, blurred)
    # Both without their own line over t; what remains of the map is explained by what remains of the structure.
    spread = t2 - t1 * t1 / n
    line_b, line_p = (b1 - t1 * b0 / n) / spread, (p1 - t1 * p0 / n) / spread
    rest_b = b2 - b0 * b0 / n - line_b * line_b * spread
    rest_pb = pb - p0 * b0 / n - line_b * line_p * spread
    rest_p = pp - p0 * p0 / n - line_p * line_p * spread
    if not strongest >= LEAST_CREST_HEIGHT:
        return 0.0, 0.0, 0.0, np.inf
    height = rest_pb / rest_b
    slope = line_p - height * line_b
    ground = (p0 - height * b0 - slope * t1) / n
    misfit = sqrt(max(rest_p - height * rest_pb, 0.0) / n) / max(abs(height) * strongest, 1e-30)
    return height, ground + crest, slope, misfit


@kernel
def _crest(values, x, y, across, down, sign):
    """How far along the line the highest (sign 1) or lowest (-1) place within 2 px lies."""
    first = last = 0.0
    highest = -np.inf
    for k in range(-4, 5):
        height = sign * height_at(values, x + across * k / 2.0, y + down * k / 2.0)
        if height > highest:
            first, highest = k / 2.0, height
        # Between two pixels as high as each other lies the crest.
        if height >= highest:
            last = k / 2.0
    return 0.5 * (first + last)


@kernel
def _feet(values, x, y, across, down, sign, reach, least_edge):
    """Where a ridge (sign 1) or slit (-1) with its crest at (x, y) ends before and after, px; 0, 0 if it is none.

    Both sides must be lower than the crest by least_edge, and not much higher than each other.
    """
    crest = height_at(values, x, y)
    before, low, _, _ = walk(values, x, y, sign * across, sign * down, -sign, reach, 1.0, np.inf)
    if not sign * (crest - low) >= least_edge:
        return 0.0, 0.0
    after, high, _, _ = walk(values, x, y, -sign * across, -sign * down, -sign, reach, 1.0, np.inf)
    drops = sign * (crest - low), sign * (crest - high)
    if not min(drops) >= max(least_edge, LEAST_SIDE_HEIGHT * max(drops)):
        return 0.0, 0.0
    return before, after


@kernel
def _is_relief(values, x, y, across, down, feet, sign, far):
    """Whether the map rises (sign 1) or falls (-1) again beyond both feet of a crest, up to so far from it."""
    crest = height_at(values, x, y)
    for side in (-1, 1):
        foot, across_side, down_side = feet[0] if side < 0 else feet[1], side * across, side * down
        ground = height_at(values, x + across_side * foot, y + down_side * foot)
        level = ground + FLAT_SHARE * (crest - ground)
        if not passes(values, x, y, across_side, down_side, foot, max(far, foot), sign, level):
            return False
    return True


@kernel
def structure_at(values, photo, x, y, across, down, far, sign, sigma, least_edge, shares, taps):
    """What the pixel (x, y) is to a ridge (sign 1) or slit (-1) whose crest lies about `far` px along the line.

    Returns (its height, height of the ground, share of the pixel it covers); a height of 0 where there is none.
    """
    crest_x, crest_y = x + across * far, y + down * far
    found = _crest(values, crest_x, crest_y, across, down, sign)
    far, crest_x, crest_y = far + found, crest_x + across * found, crest_y + down * found
    reach = ceil((PLATEAU_SIGMAS + 0.5 + WIDEST_SIGMAS / 2) * sigma)
    feet = _feet(values, crest_x, crest_y, across, down, sign, reach, least_edge)
    if feet[0] == 0 or _is_relief(values, crest_x, crest_y, across, down, feet, sign, RETURN_SIGMAS * sigma):
        return 0.0, 0.0, 0.0
    first, last = _structure_shares(photo, crest_x, crest_y, across, down, feet, WIDEST_SIGMAS * sigma + 1, shares)
    if last < first:
        return 0.0, 0.0, 0.0
    height, ground, slope, misfit = _fit_structure(
        values, crest_x, crest_y, across, down, shares, first, last, sigma, taps
    )
    if not (misfit <= MOST_CREST_MISFIT and sign * height > 0):
        return 0.0, 0.0, 0.0
    place = len(shares) // 2 - far * SAMPLES_A_PX
    k = min(max(floor(place + 0.5), 0), len(shares) - 1)
    return height, ground - slope * far, shares[k]


@kernel
def structure_blur(values, photo, x, y, across, down, sign, least_edge, shares, taps):
    """The blur of a ridge (sign 1) or slit (-1) with its crest about (x, y): (sigma, height).

    Sigma is 0 where it may as well be a hill: its sides are not flat, or no blur makes it of what the photo shows.
    """
    far = _crest(values, x, y, across, down, sign)
    x, y = x + across * far, y + down * far
    feet = _feet(values, x, y, across, down, sign, SEARCHED_PX, least_edge)
    if feet[0] == 0:
        return 0.0, 0.0
    crest = height_at(values, x, y)
    for side in (-1, 1):
        foot = feet[0] if side < 0 else feet[1]
        # Outside, pixels of the border go on: as flat as nothing else is.
        if not is_inside(values, x + side * 1.6 * foot * across, y + side * 1.6 * foot * down):
            return 0.0, 0.0
        level = height_at(values, x + side * foot * across, y + side * foot * down)
        beyond = height_at(values, x + side * 1.6 * foot * across, y + side * 1.6 * foot * down)
        if not abs(beyond - level) <= FLAT_SHARE * abs(crest - level):
            return 0.0, 0.0
    first, last = _structure_shares(photo, x, y, across, down, feet, np.inf, shares)
    best, sigma, height = MOST_CREST_MISFIT, 0.0, 0.0
    if first <= last:
        for blur in BLURS:
            fitted, _, _, misfit = _fit_structure(values, x, y, across, down, shares, first, last, blur, taps)
            if misfit < best and sign * fitted > 0:
                best, sigma, height = misfit, blur, abs(fitted)
    return sigma, height
