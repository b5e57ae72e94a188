"""Soft outlines: of fronts out of focus, and of hair, maps leave to the back what is mixed with it, pixels wide.

There it would stay behind as a ghost, and tint all that is filled beside it. Single mixed pixels beside an edge are
left to matting (`rendering/mixed_pixels.py`): a front grows only where the second pixel behind its edge is mixed, too.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from iibr_core.depth.rim_sides import step_distance
from iibr_core.runtime import tiling
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.runtime.tiling import ShouldStop, in_pieces, pieces_of
from iibr_core.types import FloatImage

SOFT_PX = 6
"""Outlines are this wide at most; pixels farther from every edge tell the colours of the back ..."""
FRONT_PX = 2
"""... and those with more than so many between them and an edge those of the front, ..."""
REACH_PX, STRIDE_PX = 14, 2
"""... within so many each way, every second row and column."""
LEAST_SAMPLES = 8
"""Fewer on either side tell nothing."""
LEAST_SHARE, MOST_SHARE = 0.1, 1.2
"""A pixel is mixed if it is so far on the way from the back's mean colour to the front's, ..."""
MOST_ASIDE = 0.25
"""... off that way by so much of its length at most, and ..."""
DEVIATIONS = 3.0
"""... so many standard deviations of the back's colours along it, ..."""
LEAST_CONTRAST = 0.1
"""... and these differ by so much (sRGB-encoded, all channels together)."""
MOST_PIECE_PIXELS = 1 << 12


def widen_fronts(colors: FloatImage, values: FloatImage, step: float, should_stop: ShouldStop) -> FloatImage:
    """The map (H, W), where fronts stand out by more than step, grown over their soft outlines in the photo (H, W, 3).

    Raises Cancelled once should_stop is true.
    """
    distance = step_distance(values, step, SOFT_PX)
    mixed, queued = np.zeros(values.shape, np.bool_), np.zeros(values.shape, np.bool_)
    pixels = _beside_fronts(values, distance, step, queued)
    # An outline hangs together with pixels that touch the front.
    while len(pixels):
        parts = [pixels[part] for part in pieces_of(len(pixels), MOST_PIECE_PIXELS)]
        find = partial(_find_mixed, colors, values, distance, step)
        pixels = pixels[np.concatenate(in_pieces(find, parts, should_stop, tiling.THREADS))]
        mixed.reshape(-1)[pixels] = True
        pixels = _around(queued, pixels)
    mixed = _outlines(colors, values, distance, step, np.flatnonzero(mixed))
    for _ in range(SOFT_PX):
        grown = _grow(values, mixed, step, np.flatnonzero(mixed))
        if not len(grown[0]):
            break
        values = values.copy()
        values.reshape(-1)[grown[0]] = grown[1]
        mixed.reshape(-1)[grown[0]] = False
    return values


@kernel
def _nearest_front(values, y, x, step):
    """Where the nearest pixel is that stands before this one; itself where there is none within SOFT_PX."""
    height, width = values.shape
    front_y, front_x, nearest = y, x, 2 * (SOFT_PX + 1) ** 2 + 1
    for v in range(max(y - SOFT_PX - 1, 0), min(y + SOFT_PX + 2, height)):
        for u in range(max(x - SOFT_PX - 1, 0), min(x + SOFT_PX + 2, width)):
            away = (v - y) ** 2 + (u - x) ** 2
            if away < nearest and values[v, u] - values[y, x] > step:
                front_y, front_x, nearest = v, u, away
    return front_y, front_x


@kernel
def _is_mixed(colors, values, distance, y, x, step):
    """Whether a pixel behind an edge has a colour on the way from the back's to the front's."""
    height, width = values.shape
    if distance[y, x] > SOFT_PX:
        return False
    front_y, front_x = _nearest_front(values, y, x, step)
    own, front = values[y, x], values[front_y, front_x]
    if front == own:
        return False
    # Colours of both surfaces, where nothing is mixed.
    half = 0.5 * (front - own)
    rows = range(max(y - REACH_PX, 0), min(y + REACH_PX + 1, height), STRIDE_PX)
    columns = range(max(x - REACH_PX, 0), min(x + REACH_PX + 1, width), STRIDE_PX)
    backs = fronts = r0 = g0 = b0 = r1 = g1 = b1 = 0.0
    for v in rows:
        for u in columns:
            if distance[v, u] > SOFT_PX and abs(values[v, u] - own) <= half:
                backs += 1
                r0, g0, b0 = r0 + colors[v, u, 0], g0 + colors[v, u, 1], b0 + colors[v, u, 2]
            elif distance[v, u] > FRONT_PX and abs(values[v, u] - front) <= half:
                fronts += 1
                r1, g1, b1 = r1 + colors[v, u, 0], g1 + colors[v, u, 1], b1 + colors[v, u, 2]
    if min(backs, fronts) < LEAST_SAMPLES:
        return False
    back = r0 / backs, g0 / backs, b0 / backs
    way = r1 / fronts - back[0], g1 / fronts - back[1], b1 / fronts - back[2]
    contrast = along = apart = 0.0
    for c in range(3):
        contrast += way[c] ** 2
        along += way[c] * (colors[y, x, c] - back[c])
        apart += (colors[y, x, c] - back[c]) ** 2
    if not (
        contrast > LEAST_CONTRAST**2
        and LEAST_SHARE * contrast < along < MOST_SHARE * contrast
        and apart - along**2 / contrast < MOST_ASIDE**2 * contrast
    ):
        return False
    # Few are left to be told from what the back's colours differ by themselves.
    spread = 0.0
    for v in rows:
        for u in columns:
            if distance[v, u] > SOFT_PX and abs(values[v, u] - own) <= half:
                off = 0.0
                for c in range(3):
                    off += way[c] * (colors[v, u, c] - back[c])
                spread += off * off
    return along**2 > DEVIATIONS**2 * spread / backs


@kernel
def _find_mixed(colors, values, distance, step, pixels):
    """Which of these pixels (N, flat indices) are mixed."""
    found, width = np.empty(len(pixels), np.bool_), values.shape[1]
    for i in range(len(pixels)):
        found[i] = _is_mixed(colors, values, distance, pixels[i] // width, pixels[i] % width, step)
    return found


@kernel
def _around(queued, pixels):
    """The pixels that touch these (flat indices), and are not queued yet; now they are."""
    height, width = queued.shape
    found, count = np.empty(8 * len(pixels), np.int64), 0
    for pixel in pixels:
        y, x = pixel // width, pixel % width
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if not queued[v, u]:
                    queued[v, u] = True
                    found[count] = v * width + u
                    count += 1
    return found[:count]


@kernel
def _ends_clean(colors, values, distance, y, x, step):
    """Whether what is mixed around a pixel ends within SOFT_PX of the front: else it is the back's own."""
    height, width = values.shape
    front_y, front_x = _nearest_front(values, y, x, step)
    away = max(abs(y - front_y), abs(x - front_x))
    for k in range(SOFT_PX - 1, SOFT_PX + 1):
        v, u = front_y + nearest_pixel((y - front_y) * k / away), front_x + nearest_pixel((x - front_x) * k / away)
        if not (0 <= v < height and 0 <= u < width) or _is_mixed(colors, values, distance, v, u, step):
            return False
    return True


@kernel
def _outlines(colors, values, distance, step, pixels):
    """Those of mixed pixels (flat indices), (H, W), that end clean."""
    outlines = np.zeros(values.shape, np.bool_)
    for i in range(len(pixels)):
        y, x = pixels[i] // values.shape[1], pixels[i] % values.shape[1]
        outlines[y, x] = _ends_clean(colors, values, distance, y, x, step)
    return outlines


@kernel
def _front_beside(values, y, x, step):
    """The disparity most in front among a pixel and its neighbours, if that stands before it; else its own."""
    height, width = values.shape
    front = values[y, x]
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            front = max(front, values[v, u])
    return front if front - values[y, x] > step else values[y, x]


@kernel
def _beside_fronts(values, distance, step, queued):
    """The pixels (flat indices) that touch a front; they are marked as queued. distance (H, W): see `step_distance`."""
    height, width = values.shape
    found, count = np.empty(values.size, np.int64), 0
    for y in range(height):
        for x in range(width):
            if distance[y, x] <= SOFT_PX and _front_beside(values, y, x, step) != values[y, x]:
                queued[y, x] = True
                found[count] = y * width + x
                count += 1
    return found[:count]


@kernel
def _grow(values, mixed, step, pixels):
    """Of these pixels (flat indices), those that touch a front and have a mixed neighbour that touches none; the
    disparity of that front.
    """
    height, width = values.shape
    grown, fronts, count = np.empty(len(pixels), np.int64), np.empty(len(pixels), np.float32), 0
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        front, is_wide = _front_beside(values, y, x, step), False
        if front == values[y, x]:
            continue
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if mixed[v, u] and abs(values[v, u] - values[y, x]) <= step:
                    is_wide |= _front_beside(values, v, u, step) == values[v, u]
        if is_wide:
            grown[count], fronts[count] = pixels[i], front
            count += 1
    return grown[:count], fronts[:count]
