"""Soft outlines: of fronts out of focus, and of hair, maps leave to the back what is mixed with it, pixels wide.

There it would stay behind as a ghost, and tint all that is filled beside it. Single mixed pixels beside an edge are
left to matting (`rendering/mixed_pixels.py`): a front grows only where the second pixel behind its edge is mixed, too,
and along outlines that go on and fade. Edges of other things look like the front here and there, but do neither.
The last of a front's light is too faint to be told from its back, but would stay behind as a line: one pixel more goes
with the front.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from iibr_core.depth.edges.rim_sides import step_distance
from iibr_core.inpainting.nearest_known import number_pixels
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
LEAST_LENGTH_PX, GAP_PX = 24, 3
"""An outline goes on for so many pixels, with so many at most from one to the next, ..."""
MOST_BEYOND = 0.5
"""... and the front's mean share falls, to less than this at its second pixel. Else it is an edge of something else."""
MOST_PIECE_PIXELS = 1 << 12


def widen_fronts(colors: FloatImage, values: FloatImage, step: float, should_stop: ShouldStop) -> FloatImage:
    """The map (H, W), where fronts stand out by more than step, grown over their soft outlines in the photo (H, W, 3).

    Raises Cancelled once should_stop is true.
    """
    shares = _find_mixed(colors, values, step, should_stop)
    shares = _outlines(values, shares, step, np.flatnonzero(shares > 0))
    mixed = np.flatnonzero(shares > 0)
    pixels, fronts, beyond = _grow(values, shares, step, mixed)
    number = np.empty(values.shape, np.int32)
    number_pixels(pixels, number)
    fades = _fades(pixels, shares.reshape(-1)[pixels], beyond, number)
    shares.reshape(-1)[pixels] = 0
    if not fades.any():
        return values
    values, rings = values.copy(), [pixels[fades]]
    values.reshape(-1)[rings[0]] = fronts[fades]
    for _ in range(SOFT_PX - 1):
        mixed = mixed[shares.reshape(-1)[mixed] > 0]
        pixels, fronts, _ = _grow(values, shares, step, mixed)
        values.reshape(-1)[pixels] = fronts
        shares.reshape(-1)[pixels] = 0
        rings.append(pixels)
    pixels, fronts = _just_behind(values, step, np.concatenate(rings), number)
    values.reshape(-1)[pixels] = fronts
    return values


def _find_mixed(colors: FloatImage, values: FloatImage, step: float, should_stop: ShouldStop) -> FloatImage:
    """(H, W): the front's share in what is mixed just behind an edge, what is mixed beside that, and so on; or 0."""
    distance, shares = step_distance(values, step, SOFT_PX), np.zeros(values.shape, np.float32)
    fronts = np.full(values.shape, np.nan, np.float32)
    ring = _first_ring(values, step, np.flatnonzero(distance == 0), fronts)
    for _ in range(SOFT_PX):
        parts = [ring[part] for part in pieces_of(len(ring), MOST_PIECE_PIXELS)]
        in_pieces(partial(_weigh_colors, colors, values, distance, fronts, shares), parts, should_stop, tiling.THREADS)
        ring = _next_ring(values, step, distance, shares, ring, fronts)
    return shares


@kernel
def _first_ring(values, step, pixels, fronts):
    """Those of these pixels (flat indices) that touch a front; its disparity goes to fronts (H, W)."""
    width = values.shape[1]
    ring, count = np.empty(len(pixels), np.int64), 0
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        front = _front_beside(values, y, x, step)
        if front != values[y, x]:
            fronts[y, x], ring[count] = front, pixels[i]
            count += 1
    return ring[:count]


@kernel
def _next_ring(values, step, distance, shares, ring, fronts):
    """Pixels (flat indices) beside mixed ones of a ring, on their surface and in no ring yet; fronts are passed on."""
    height, width = values.shape
    beyond, count = np.empty(8 * len(ring), np.int64), 0
    for i in range(len(ring)):
        y, x = ring[i] // width, ring[i] % width
        if shares[y, x] == 0:
            continue
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                is_new = distance[v, u] <= SOFT_PX and np.isnan(fronts[v, u])
                if is_new and abs(values[v, u] - values[y, x]) <= step:
                    fronts[v, u], beyond[count] = fronts[y, x], v * width + u
                    count += 1
    return beyond[:count]


@kernel
def _weigh_colors(colors, values, distance, fronts, shares, pixels):
    """How far these pixels' colours (flat indices) are on the way from their surface's to those of fronts (H, W), where
    they are on it, goes to shares (H, W).
    """
    height, width = values.shape
    total, mean = np.empty(2), np.empty((2, 3))
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        own, front = values[y, x], fronts[y, x]
        half = 0.5 * (front - own)
        # Colours of both surfaces, where nothing is mixed.
        total[:], mean[:] = 0.0, 0.0
        for v in range(max(y - REACH_PX, 0), min(y + REACH_PX + 1, height), STRIDE_PX):
            for u in range(max(x - REACH_PX, 0), min(x + REACH_PX + 1, width), STRIDE_PX):
                if distance[v, u] > SOFT_PX and abs(values[v, u] - own) <= half:
                    total[0] += 1
                    for c in range(3):
                        mean[0, c] += colors[v, u, c]
                elif distance[v, u] > FRONT_PX and abs(values[v, u] - front) <= half:
                    total[1] += 1
                    for c in range(3):
                        mean[1, c] += colors[v, u, c]
        if total.min() < LEAST_SAMPLES:
            continue
        back, way = mean[0] / total[0], mean[1] / total[1] - mean[0] / total[0]
        contrast = along = apart = 0.0
        for c in range(3):
            off = colors[y, x, c] - back[c]
            contrast, along, apart = contrast + way[c] ** 2, along + way[c] * off, apart + off**2
        if not (
            contrast > LEAST_CONTRAST**2
            and LEAST_SHARE * contrast < along < MOST_SHARE * contrast
            and apart - along**2 / contrast < MOST_ASIDE**2 * contrast
        ):
            continue
        spread = 0.0
        for v in range(max(y - REACH_PX, 0), min(y + REACH_PX + 1, height), STRIDE_PX):
            for u in range(max(x - REACH_PX, 0), min(x + REACH_PX + 1, width), STRIDE_PX):
                if distance[v, u] > SOFT_PX and abs(values[v, u] - own) <= half:
                    off = 0.0
                    for c in range(3):
                        off += way[c] * (colors[v, u, c] - back[c])
                    spread += off**2
        if along**2 > DEVIATIONS**2 * spread / total[0]:
            shares[y, x] = along / contrast


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
def _ends_clean(values, shares, y, x, step):
    """Whether what is mixed around a pixel ends within SOFT_PX of the front: else it is the back's own."""
    height, width = values.shape
    front_y, front_x = _nearest_front(values, y, x, step)
    away = max(abs(y - front_y), abs(x - front_x))
    # What hangs together may have risen as high as its front.
    if away == 0:
        return False
    for k in range(SOFT_PX - 1, SOFT_PX + 1):
        v, u = front_y + nearest_pixel((y - front_y) * k / away), front_x + nearest_pixel((x - front_x) * k / away)
        if not (0 <= v < height and 0 <= u < width) or shares[v, u] > 0:
            return False
    return True


@kernel
def _outlines(values, shares, step, pixels):
    """The shares (H, W) of those pixels (flat indices) that end clean."""
    outlines = np.zeros_like(shares)
    for i in range(len(pixels)):
        y, x = pixels[i] // values.shape[1], pixels[i] % values.shape[1]
        if _ends_clean(values, shares, y, x, step):
            outlines[y, x] = shares[y, x]
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
def _grow(values, shares, step, pixels):
    """Of these pixels (flat indices), those that touch a front and have mixed neighbours that touch none; the disparity
    of that front, and those neighbours' mean share.
    """
    height, width = values.shape
    grown, count = np.empty(len(pixels), np.int64), 0
    fronts, beyond = np.empty(len(pixels), np.float32), np.empty(len(pixels), np.float32)
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        front, total, places = _front_beside(values, y, x, step), 0.0, 0
        if front == values[y, x]:
            continue
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                is_beside = shares[v, u] > 0 and abs(values[v, u] - values[y, x]) <= step
                if is_beside and _front_beside(values, v, u, step) == values[v, u]:
                    total, places = total + shares[v, u], places + 1
        if places > 0:
            grown[count], fronts[count], beyond[count] = pixels[i], front, total / places
            count += 1
    return grown[:count], fronts[:count], beyond[:count]


@kernel
def _just_behind(values, step, pixels, number):
    """The pixels right behind these of a front (flat indices), and its disparity. number (H, W): negative; here and in
    what comes back each pixel is found once.
    """
    height, width = values.shape
    behind, fronts, count = np.empty(8 * len(pixels), np.int64), np.empty(8 * len(pixels), np.float32), 0
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if number[v, u] < 0 and values[y, x] - values[v, u] > step:
                    behind[count], fronts[count] = v * width + u, _front_beside(values, v, u, step)
                    number[v, u] = count
                    count += 1
    return behind[:count], fronts[:count]


@kernel
def _fades(pixels, shares, beyond, number):
    """Which of these pixels (flat indices) are of an outline that fades: LEAST_LENGTH_PX and more, each within GAP_PX
    of another. shares, beyond (N,): the front's in each, and just beyond it. number (H, W): which one each pixel is, or
    -1; comes back as -1.
    """
    height, width = number.shape
    together, fades = np.empty(len(pixels), np.int64), np.zeros(len(pixels), np.bool_)
    for first in range(len(pixels)):
        together[0], count, looked_at, own_share, beyond_share = first, 0, 0, 0.0, 0.0
        if number[pixels[first] // width, pixels[first] % width] == first:
            number[pixels[first] // width, pixels[first] % width], count = -1, 1
        while looked_at < count:
            n = together[looked_at]
            y, x, looked_at = pixels[n] // width, pixels[n] % width, looked_at + 1
            own_share, beyond_share = own_share + shares[n], beyond_share + beyond[n]
            for v in range(max(y - GAP_PX, 0), min(y + GAP_PX + 1, height)):
                for u in range(max(x - GAP_PX, 0), min(x + GAP_PX + 1, width)):
                    if number[v, u] >= 0:
                        together[count], number[v, u] = number[v, u], -1
                        count += 1
        if count >= LEAST_LENGTH_PX and beyond_share < min(own_share, MOST_BEYOND * count):
            for n in range(count):
                fades[together[n]] = True
    return fades
