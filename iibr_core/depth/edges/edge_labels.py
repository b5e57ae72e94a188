"""Which of two surfaces each pixel of an edge band shows: a conditional random field along the depth edges of any map.

A pixel stays on its own surface or takes the nearest other one. Three things count: where the map has it, whose colours
it has (a kernel density of those around, on either side; mixed colours are the foreground's), and where the neighbours
are that look like it. How far the map is wrong is measured on the map itself, by how often colours contradict it: in
front of its edges and behind them, pixel by pixel. So exact maps keep their edges, and dilated, eroded, ragged and
coarse ones get those of the photo.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import ceil, exp, log, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.disparity_by_color import nearness
from iibr_core.inpainting.nearest_known import number_pixels
from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces, pieces_of
from iibr_core.surfaces import SLOPE_SHARE, same_surface
from iibr_core.types import FloatImage

LABELLED_PX = 4
"""Pixels with fewer others between them and a step are labelled; those with as many tell how often colours mislead."""
LABEL_PX, STRIDE_PX, SPREAD_PX = 8, 2, 4.0
"""Every second pixel within so many, each way, tells both surfaces' colours; standard deviation of their weights by
distance.
"""
LABEL_NEARNESS = nearness(LABEL_PX, SPREAD_PX).astype(np.float32)
LABEL_NEARNESS[LABEL_PX, LABEL_PX] = 0
"""Those weights, (2 LABEL_PX + 1, 2 LABEL_PX + 1); the pixel itself, in the middle, tells nothing."""
TRUST = np.append(np.geomspace(0.1, 1.0, LABELLED_PX + 1), 1.0).astype(np.float32)
"""Their weights by how many pixels lie between them and a step: nearer ones are mixed, or on the wrong side."""
LEAST_FOREGROUND = 0.7
"""Weight of all pixels of a foreground together, below which it keeps its pixels: it is a pixel thin."""
LIKENESS = 0.5
"""Its standard deviation, of a pixel to a surface and to a neighbour, in mean steps of colour in the band."""
UNLIKE, UNSEEN_WEIGHT = 0.03, 0.3
"""Likelihood of a colour that nothing on a surface has; weight of that possibility against what was seen."""
PRIOR_WEIGHT = 1.5
"""How much the map counts, by the log odds of its being right, and each neighbour that is on the same surface and looks
alike, in units of log likelihood of the colours. With less, thin wires are lost.
"""
CLEAR = 1.5
"""Log likelihood ratio from which colours are clear."""
MIXED_SHARES = (0.1, 0.25)
"""Share of the pixels just behind and just in front of exact steps whose colours contradict the map: they are mixed."""
LEAST_WRONG = 0.02
"""Share of pixels that a map is taken to have on the wrong side, and on the right one, at least."""
TELLING = 0.2
"""Share of the pixels beside steps whose colours must be clear to tell of the map, as both sides of a slope look alike.
Where colours contradict the map inside surfaces in a larger share of what they do there, they tell shade from light.
"""
EXACT = 0.1
"""Where it has a smaller share there everywhere, it stays as it is."""
MOST_MEASURED_PIXELS = 1 << 14
"""Of the band, at most, tell how far the map is wrong."""
PASSES = 8
"""Of mean field (Kraehenbuehl and Koltun 2011)."""
MOST_PIECE_PIXELS = 1 << 12
AROUND = np.indices((2 * LABELLED_PX + 3,) * 2).reshape(2, -1).T - LABELLED_PX - 1
AROUND = AROUND[np.argsort((AROUND**2).sum(axis=1), kind="stable")][1:]
"""Rows and columns from a pixel to those around it, nearest first: where its other surface is looked for."""
NEIGHBOURS = AROUND[:8]
"""The eight that touch it."""


def label_edges(colors: FloatImage, values: FloatImage, unknown: NDArray[np.bool_], least_edge: float) -> FloatImage:
    """The map (H, W), every pixel beside a step (larger than least_edge) on the side that the photo (H, W, 3) shows.

    unknown: (H, W), where the map says nothing by itself. Outside the band its bits stay, and everywhere where colours
    contradict the map beside steps no more often than an exact one.
    """
    distance = step_distance(values, least_edge)
    pixels = np.flatnonzero(distance <= LABELLED_PX)
    if not len(pixels):
        return values
    alike = LIKENESS * _mean_color_step(colors, pixels)
    weigh = partial(_weigh_colors, colors, values, TRUST[distance], least_edge, alike)
    away, own, known = distance.reshape(-1), values.reshape(-1), ~unknown.reshape(-1)
    few = pixels[:: ceil(len(pixels) / MOST_MEASURED_PIXELS)]
    weighed = _in_parts(weigh, few)
    wrong = _measure_errors(weighed, own[few], away[few], known[few])
    if wrong.max() <= EXACT:
        return values
    other, evidence = weighed if len(few) == len(pixels) else _in_parts(weigh, pixels)
    away, own, known = away[pixels], own[pixels], known[pixels]
    odds = np.float32(PRIOR_WEIGHT) * np.log((1 - wrong) / wrong)
    prior = np.where(known, odds[(own > other).astype(np.intp), away], np.float32(0))
    drive = np.where(other == own, np.float32(np.inf), evidence + prior)
    belief = _mean_field(colors, values, pixels, other, drive, alike)
    labelled = values.copy()
    labelled.reshape(-1)[pixels] = np.where(belief < 0.5, other, own)
    return labelled


def step_distance(
    values: FloatImage, least_edge: float, reach_px: int = LABELLED_PX, counts_slopes: bool = False
) -> NDArray[np.uint8]:
    """(H, W): how many pixels lie between each and the nearest step larger than least_edge; at most reach_px + 1.

    counts_slopes: whether a step counts that goes on before and after it.
    """
    distance = np.full(values.shape, reach_px + 1, np.uint8)
    _mark_steps(values, least_edge, counts_slopes, distance)
    _spread(distance)
    _spread(distance[::-1, ::-1])
    return distance


def _mean_color_step(colors: FloatImage, pixels: NDArray[np.int64]) -> float:
    """Root mean square distance of these pixels' colours (flat indices) from those of the pixels after them."""
    flat = colors.reshape(-1, 3)
    steps = flat[pixels] - flat[np.minimum(pixels + 1, len(flat) - 1)]
    return max(float(np.sqrt(np.nanmean(np.square(steps, dtype=np.float64).sum(axis=1)))), 1e-3)


def _in_parts(
    weigh: Callable[[NDArray[np.int64]], tuple[FloatImage, FloatImage]],
    pixels: NDArray[np.int64],
) -> tuple[FloatImage, FloatImage]:
    """What `_weigh_colors` says of pixels (N, flat indices)."""
    parts = [pixels[part] for part in pieces_of(len(pixels), MOST_PIECE_PIXELS)]
    weighed = in_pieces(weigh, parts, tiling.THREADS)
    return np.concatenate([pair[0] for pair in weighed]), np.concatenate([pair[1] for pair in weighed])


def _measure_errors(
    weighed: tuple[FloatImage, FloatImage], own: FloatImage, away: NDArray[np.uint8], known: NDArray[np.bool_]
) -> FloatImage:
    """(2, LABELLED_PX + 1): the share of pixels that a map has on the wrong side, behind and in front of a step, by how
    many pixels lie between.
    """
    other, evidence = weighed
    clear, in_front = known & (np.abs(evidence) > CLEAR), own > other
    wrong = np.empty((2, LABELLED_PX + 1), np.float32)
    for side in range(2):
        misled = _contradicted(evidence[clear & (in_front == side) & (away == LABELLED_PX)])
        for k in range(LABELLED_PX + 1):
            by_chance = max(misled, MIXED_SHARES[side]) if k == 0 else misled
            here = (in_front == side) & (away == k)
            contradicted = _contradicted(evidence[clear & here], misled)
            is_told = np.count_nonzero(clear & here) >= TELLING * np.count_nonzero(known & here)
            tells = is_told and misled <= TELLING * contradicted
            wrong[side, k] = (contradicted - by_chance) / max(1 - misled - by_chance, 0.1) if tells else 0.0
    return np.clip(wrong, LEAST_WRONG, 1 - LEAST_WRONG)


def _contradicted(evidence: FloatImage, expected: float = 0.05) -> float:
    """Share of these pixels whose colours speak against the map; few pixels leave it near what is expected."""
    return (np.count_nonzero(evidence < 0) + 20 * expected) / (len(evidence) + 20)


def _mean_field(
    colors: FloatImage,
    values: FloatImage,
    pixels: NDArray[np.int64],
    other: FloatImage,
    drive: FloatImage,
    alike: float,
) -> FloatImage:
    """(N): how likely each pixel (flat index) is on its own surface rather than on the other."""
    number = np.full(values.shape, -1, np.int32)
    number_pixels(pixels, number)
    drive, votes = drive.copy(), np.empty((len(pixels), len(NEIGHBOURS)), np.float32)
    belief = np.ones(len(pixels), np.float32)
    firsts = range(0, len(pixels), MOST_PIECE_PIXELS)
    count = partial(_count_votes, colors, values, pixels, number, other, alike, drive, votes)
    in_pieces(count, firsts, tiling.THREADS)
    for _ in range(PASSES):
        believed, belief = belief, np.empty_like(belief)
        work = partial(_believe, pixels, number, drive, votes, believed, belief)
        in_pieces(work, firsts, tiling.THREADS)
    return belief


@kernel
def _is_slope(values, y, x, v, u, step):
    """Whether the map rises or falls likewise before a pixel (y, x) and after the next one (v, u)."""
    height, width = values.shape
    above, left, below, right = 2 * y - v, 2 * x - u, 2 * v - y, 2 * u - x
    # The border hides one of both.
    before = values[y, x] - values[above, left] if above >= 0 and left >= 0 else step
    after = values[below, right] - values[v, u] if below < height and right < width else step
    return min(before * step, after * step) >= SLOPE_SHARE * step * step


@kernel
def _mark_steps(values, least_edge, counts_slopes, distance):
    """0 where `step_distance` is."""
    height, width = values.shape
    for y in range(height):
        for x in range(width):
            for v, u in ((y, min(x + 1, width - 1)), (min(y + 1, height - 1), x)):
                step = values[v, u] - values[y, x]
                if abs(step) > least_edge and (counts_slopes or not _is_slope(values, y, x, v, u, step)):
                    distance[y, x] = distance[v, u] = 0


@kernel
def _spread(distance):
    """Each distance at most one more than those above and to the left of it."""
    height, width = distance.shape
    for y in range(height):
        for x in range(width):
            left, right, above = max(x - 1, 0), min(x + 1, width - 1), max(y - 1, 0)
            least = min(distance[above, left], distance[above, x], distance[above, right], distance[y, left])
            distance[y, x] = min(distance[y, x], least + 1)


@kernel
def _nearest_other(values, y, x, least_edge):
    """The disparity of the nearest pixel on another surface; the pixel's own where there is none within reach."""
    height, width = values.shape
    for n in range(len(AROUND)):
        v, u = y + AROUND[n, 0], x + AROUND[n, 1]
        if 0 <= v < height and 0 <= u < width and not same_surface(values[v, u], values[y, x], least_edge):
            return values[v, u]
    return values[y, x]


@kernel
def _weigh_colors(colors, values, trust, least_edge, alike, pixels):
    """Of pixels (N, flat indices): the disparity of the other surface (N), and what the colours say (N): the log of
    the likelihood that the pixel is on its own surface over that of the other. Without another, its own and 0.
    trust (H, W): how much each pixel tells.
    """
    height, width = values.shape
    others, evidence = np.empty(len(pixels), np.float32), np.zeros(len(pixels), np.float32)
    # Of its own surface and of the other: weight, likeness, sum of colours, sum of their squares.
    weight, like, total, squares = np.empty(2), np.empty(2), np.empty((2, 3)), np.empty(2)
    sharpness = np.float32(-0.5 / (alike * alike))
    for n in range(len(pixels)):
        y, x = pixels[n] // width, pixels[n] % width
        own, other = values[y, x], _nearest_other(values, y, x, least_edge)
        others[n] = own
        if other == own:
            continue
        half = 0.5 * abs(other - own)
        weight[:], like[:], total[:], squares[:] = 0.0, 0.0, 0.0, 0.0
        for v in range(y - min(y, LABEL_PX) // STRIDE_PX * STRIDE_PX, min(y + LABEL_PX + 1, height), STRIDE_PX):
            for u in range(x - min(x, LABEL_PX) // STRIDE_PX * STRIDE_PX, min(x + LABEL_PX + 1, width), STRIDE_PX):
                to_own, to_other = abs(values[v, u] - own), abs(values[v, u] - other)
                # A third surface, or none.
                if not min(to_own, to_other) <= half:
                    continue
                side = 0 if to_own <= to_other else 1
                w = LABEL_NEARNESS[v - y + LABEL_PX, u - x + LABEL_PX] * trust[v, u]
                apart = square = np.float32(0.0)
                for c in range(3):
                    color = colors[v, u, c]
                    apart += (color - colors[y, x, c]) ** 2
                    square += color * color
                    total[side, c] += w * color
                squares[side] += w * square
                # Colours that are not finite are like no other.
                weight[side] += w
                like[side] += w * exp(apart * sharpness) if apart < np.inf else 0.0
        # A wire that the map has beside its place would be lost: nothing knows its colours.
        if not weight[1] > 0 or (own > other and weight[0] < LEAST_FOREGROUND):
            continue
        others[n] = other
        background = 0 if other > own else 1
        for side in range(2):
            like[side] = (like[side] + UNSEEN_WEIGHT * UNLIKE) / (weight[side] + UNSEEN_WEIGHT)
        if weight[0] > 0:
            mixed = _mixed_likelihood(colors[y, x], weight, total, squares[background], background, alike)
            like[1 - background] = max(like[1 - background], mixed)
        evidence[n] = log((like[0] + UNLIKE) / (like[1] + UNLIKE))
    return others, evidence


@kernel
def _mixed_likelihood(color, weight, total, background_squares, background, alike):
    """How likely a colour is a mixture of both surfaces' mean colours, by all shares alike; 0 where the foreground's
    share is lost in the spread of the background's colours. weight (2), total (2, 3): see `_weigh_colors`; background:
    which of both is the background.
    """
    contrast = along = away = 0.0
    spread = background_squares / weight[background]
    for c in range(3):
        behind = total[background, c] / weight[background]
        way, off = total[1 - background, c] / weight[1 - background] - behind, color[c] - behind
        contrast, along, away = contrast + way * way, along + way * off, away + off * off
        spread -= behind * behind
    # Colours that are not finite fail the comparison.
    if not contrast > 1e-9:
        return 0.0
    share = along / contrast
    if not sqrt(max(spread, 0.0) / contrast) < share < 1.0:
        return 0.0
    aside = max(away - along * share, 0.0)
    return exp(-0.5 * aside / (alike * alike)) * min(sqrt(2.0 * np.pi / contrast) * alike, 1.0)


@kernel
def _count_votes(colors, values, pixels, number, other, alike, drive, votes, first):
    """For MOST_PIECE_PIXELS pixels from the first on: what each neighbour adds if it is on its own surface rather than
    on its other one, votes (N, 8); what it says on its other one goes to drive (N).
    """
    height, width = values.shape
    for n in range(first, min(first + MOST_PIECE_PIXELS, len(pixels))):
        y, x = pixels[n] // width, pixels[n] % width
        own, half = values[y, x], 0.5 * abs(other[n] - values[y, x])
        votes[n] = 0.0
        if half == 0:
            continue
        for j in range(len(NEIGHBOURS)):
            v, u = y + NEIGHBOURS[j, 0], x + NEIGHBOURS[j, 1]
            if not (0 <= v < height and 0 <= u < width):
                continue
            # On its own surface a neighbour votes for whichever of both that is, on its other one likewise.
            k = number[v, u]
            stays = _vote(values[v, u], own, other[n], half)
            leaves = _vote(other[k], own, other[n], half) if k >= 0 else stays
            if stays == 0 and leaves == 0:
                continue
            apart = np.float32(0.0)
            for c in range(3):
                apart += (colors[v, u, c] - colors[y, x, c]) ** 2
            weight = PRIOR_WEIGHT * exp(-0.5 * apart / (alike * alike)) if apart < np.inf else 0.0
            drive[n] += weight * leaves
            votes[n, j] = weight * (stays - leaves)


@kernel
def _vote(value, own, other, half):
    """1 for a pixel's own surface, -1 for the other one, 0 for none: on which of both this disparity is."""
    if same_surface(value, own, half):
        return 1.0
    return -1.0 if same_surface(value, other, half) else 0.0


@kernel
def _believe(pixels, number, drive, votes, believed, belief, first):
    """One pass of mean field over MOST_PIECE_PIXELS pixels from the first on: their belief by the neighbours'."""
    width = number.shape[1]
    for n in range(first, min(first + MOST_PIECE_PIXELS, len(pixels))):
        y, x = pixels[n] // width, pixels[n] % width
        total = drive[n]
        for j in range(len(NEIGHBOURS)):
            if votes[n, j] != 0:
                total += votes[n, j] * believed[number[y + NEIGHBOURS[j, 0], x + NEIGHBOURS[j, 1]]]
        belief[n] = 1.0 / (1.0 + exp(-min(max(total, -30.0), 30.0)))
