"""Areas without texture match at every disparity: they are moved to the farthest of the surfaces at their borders.

An edge between two such areas belongs to the nearer one: it is the outline of an object, and shows nothing of what is
behind. Matching alone would spread the disparity of every outline to both of its sides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.guess import box_filter
from iibr_core.depth.multi_view.matching import HIDDEN_FACTOR
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

NOISE_SHARE = 0.75
"""Share by which noise of one view may raise a cost. Pairs get none: too many of their places match by chance."""
MIN_LIMIT = 12
"""Cost, of 255, that every match may have: that of a hidden half of the views, and errors of resampling."""
UNSEEN_COST = 255
"""Cost of disparities at which too few views see a pixel; hardly any other costs as much."""
STRIPE_RATIO = 2
"""Ratio of a cost to that of a match, between two matches of a stripe."""
MATCH_SHARE = 0.25
"""Share of the mean cost that a match of a stripe may have: errors of resampling are large there."""
STRIPE_PX = 7
"""Side of the squares, in pixels, in which most pixels match several times."""
LEAN_STEPS, MAX_LEAN = 2, 60
"""Steps of disparity that cost a stripe as much as a difference of 1 of 255, and the largest such cost."""
PLAIN_REFUTED, SIDE_REFUTED = 0.1, 0.6
"""Largest share of all disparities that do not match at a pixel of a plain area; the same at its borders."""
MAX_COLOR_STEP = 0.03
"""Largest step of a channel (1 = white) between neighbours of one area."""
MIN_PLAIN_SHARE = 0.65
"""Smallest share of an area's pixels that must be plain: surfaces with faint texture stay as they were matched."""
MIN_PIXELS = 64
"""Size of the smallest area that is moved."""
MAX_EVIDENCE = 32
"""Largest weight of a pixel: by how much other disparities cost more than its."""
LEVEL_SHARE = 0.08
"""Smallest share of the weights within three steps of disparity that shows a surface."""
GAP_SHARE = 0.01
"""Share of the weights below which a step of disparity is a gap between two surfaces."""
SLANTED_STEPS = 12
"""Number of steps without a gap that shows a slanted surface; areas beside it stay as they were matched."""


def move_plain_areas_back(
    costs: NDArray[np.uint8], colors: FloatImage, disparities: NDArray[np.float32], values: FloatImage, views: int
) -> NDArray[np.bool_]:
    """Move plain areas of a matched map (H, W) to the farthest surface at their borders; return their pixels (H, W).

    costs and disparities are those of `choose_disparity`, and values its result. colors: (H, W, 3) of the view,
    sRGB-encoded. views: number of views, this one included.
    """
    size = values.shape
    steps, limits = np.empty(size, np.int16), np.empty(size, np.float32)
    refuted, weights, is_plain = np.empty(size, np.float32), np.empty(size, np.float32), np.zeros(size, np.bool_)
    noise = np.float32(HIDDEN_FACTOR**0.5 + (NOISE_SHARE / views**0.5 if views > 2 else 0))
    _measure(costs, disparities, values, noise, steps, limits, refuted, weights)
    _move_back(costs, colors, disparities, steps, limits, refuted, weights, values, is_plain)
    return is_plain


def find_stripes(costs: NDArray[np.uint8]) -> tuple[NDArray[np.bool_], NDArray[np.uint8]]:
    """Return which pixels (H, W) lie where most match at several disparities with others between them that do not, as
    stripes and patterns do, and the largest cost of a match at each pixel (H, W).
    """
    matches, limits = np.empty(costs.shape[:2], np.float32), np.empty(costs.shape[:2], np.uint8)
    _count_matches(costs, matches, limits)
    return box_filter((matches > 1).astype(np.float32), STRIPE_PX // 2) > 0.5, limits


@kernel
def _count_matches(costs, matches, limits):
    """Fill the number of low costs of each pixel that are parted by costs STRIPE_RATIO times as high, and the limit."""
    height, width, count = costs.shape
    for y in range(height):
        for x in range(width):
            mean, seen, lowest = np.float32(0), 0, np.uint8(UNSEEN_COST)
            for index in range(count):
                if costs[y, x, index] != UNSEEN_COST:
                    lowest = min(lowest, costs[y, x, index])
                    mean += costs[y, x, index]
                    seen += 1
            low = max(MATCH_SHARE * mean / max(seen, 1), np.float32(lowest + 2), np.float32(MIN_LIMIT))
            number, is_low = 0, False
            for index in range(count):
                cost = costs[y, x, index]
                if cost <= low and not is_low:
                    number, is_low = number + 1, True
                elif cost > STRIPE_RATIO * low:
                    is_low = False
            matches[y, x], limits[y, x] = number, min(low, UNSEEN_COST)


@kernel
def lean_stripes(costs, is_striped, limits, disparities, near):
    """Let stripes cost the same at all of their matches, and a little more with the distance from a map (H, W)."""
    height, width, count = costs.shape
    for y in range(height):
        for x in range(width):
            if is_striped[y, x]:
                at = (near[y, x] - disparities[0]) / (disparities[1] - disparities[0])
                for index in range(count):
                    lean = min(abs(index - at) / LEAN_STEPS, np.float32(MAX_LEAN))
                    costs[y, x, index] = np.uint8(min(max(costs[y, x, index], limits[y, x]) + lean, UNSEEN_COST))


@kernel
def _measure(costs, disparities, values, noise, steps, limits, refuted, weights):
    """Fill each pixel's step of disparity, its largest cost of a match, the share of refuted steps, and its weight.

    If fewer than half of the disparities are seen, all count as refuted.
    """
    height, width, count = costs.shape
    for y in range(height):
        for x in range(width):
            lowest, mean, seen = np.uint8(UNSEEN_COST), np.float32(0), 0
            for index in range(count):
                if costs[y, x, index] != UNSEEN_COST:
                    lowest = min(lowest, costs[y, x, index])
                    mean += costs[y, x, index]
                    seen += 1
            mean /= max(seen, 1)
            limit = max(noise * lowest + 2, np.float32(MIN_LIMIT))
            unlike = 0
            for index in range(count):
                unlike += costs[y, x, index] != UNSEEN_COST and costs[y, x, index] > limit
            step = int(np.rint((values[y, x] - disparities[0]) / (disparities[1] - disparities[0])))
            step = min(max(step, 0), count - 1)
            steps[y, x], limits[y, x] = step, limit
            refuted[y, x] = unlike / seen if 2 * seen > count else 1
            margin = max(mean - noise * costs[y, x, step], np.float32(0))
            weights[y, x] = min(margin, np.float32(MAX_EVIDENCE)) * seen / count


@kernel
def _move_back(costs, colors, disparities, steps, limits, refuted, weights, values, is_plain):
    """Find plain areas one after the other, and move the pixels where the costs allow it; mark them in is_plain."""
    height, width, count = costs.shape
    half_step = np.float32(0.5) * (disparities[1] - disparities[0])
    queue, is_known = np.empty(height * width, np.int32), np.zeros((height, width), np.bool_)
    totals, sums = np.empty(count, np.float32), np.empty(count, np.float32)
    for start in range(height * width):
        if is_known[start // width, start % width] or refuted[start // width, start % width] > PLAIN_REFUTED:
            continue
        totals[:] = sums[:] = 0
        size, plain = _flood(start, colors, steps, refuted, weights, values, queue, is_known, totals, sums)
        # Disparities beyond the range are counted at its ends.
        totals[0] = totals[count - 1] = 0
        level = _farthest_level(totals)
        if size < MIN_PIXELS or plain < MIN_PLAIN_SHARE * size or level < 0:
            continue
        # Outlines are a little in front of what they hide.
        behind = sums[level] / totals[level] - half_step
        for at in range(size):
            y, x = queue[at] // width, queue[at] % width
            is_plain[y, x] = True
            if costs[y, x, level] <= limits[y, x]:
                values[y, x] = behind


@kernel
def _flood(start, colors, steps, refuted, weights, values, queue, is_known, totals, sums):
    """Fill the queue with pixels of one area (flat indices); return their number, and how many are surely plain.

    Weights of pixels at its edges are added to totals, by step of disparity, and weighted values to sums.
    """
    height, width = refuted.shape
    queue[0], size, at, plain = start, 1, 0, 0
    is_known[start // width, start % width] = True
    while at < size:
        y, x = queue[at] // width, queue[at] % width
        at += 1
        plain += refuted[y, x] <= PLAIN_REFUTED
        is_at_edge = False
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                is_unlike = False
                for channel in range(3):
                    is_unlike |= abs(colors[v, u, channel] - colors[y, x, channel]) > MAX_COLOR_STEP
                is_textured = refuted[v, u] > SIDE_REFUTED
                is_at_edge |= is_unlike or is_textured
                if is_textured and not is_unlike:
                    totals[steps[v, u]] += weights[v, u]
                    sums[steps[v, u]] += weights[v, u] * values[v, u]
                elif not is_unlike and not is_known[v, u]:
                    is_known[v, u] = True
                    queue[size] = v * width + u
                    size += 1
        if is_at_edge:
            totals[steps[y, x]] += weights[y, x]
            sums[steps[y, x]] += weights[y, x] * values[y, x]
    return size, plain


@kernel
def _farthest_level(totals):
    """Return the farthest step of disparity at which the weights show a surface; -1 for none or a slanted one."""
    whole, last = totals.sum(), len(totals) - 1
    if whole <= 0:
        return -1
    for index in range(1, last):
        if totals[index - 1 : index + 2].sum() >= LEVEL_SHARE * whole:
            level = index - 1 + np.argmax(totals[index - 1 : index + 2])
            end = level
            while end < last and totals[end + 1] >= GAP_SHARE * whole:
                end += 1
            return level if end - level < SLANTED_STEPS else -1
    return -1
