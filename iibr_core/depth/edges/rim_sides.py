"""Which of two surfaces the pixels of a rim belong to, by the photo: a conditional random field along depth edges.

A pixel stays on its own surface or goes to the nearest other one. Three things count: where the map has it, whose
colours it has (a kernel density of those around, on either side), and where the neighbours are that look like it. How
much the map counts is measured on the map itself, by how often colours contradict it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import exp, log

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.disparity_by_color import nearness
from iibr_core.inpainting.nearest_known import number_pixels
from iibr_core.runtime import tiling
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_pieces, pieces_of
from iibr_core.types import FloatImage

RIM_PX = 2
"""A rim: pixels with at most so many others between them and a step."""
REACH_PX, SPREAD_PX = 7, 3.5
"""Pixels within so many, each way, tell both surfaces' colours; standard deviation of their weights by distance."""
NEARNESS = nearness(REACH_PX, SPREAD_PX).astype(np.float32)
NEARNESS[REACH_PX, REACH_PX] = 0
"""Those weights, (2 REACH_PX + 1, 2 REACH_PX + 1); the pixel itself, in the middle, tells nothing."""
TRUST = np.array([0.15, 0.35, 0.7, 1.0], np.float32)
"""Their weights by how many pixels lie between them and a step: rims are mixed, or on the wrong side themselves."""
FILLED_TRUST = np.float32(0.2)
"""Of pixels that were unknown, besides."""
LIKENESS_STEPS = 64
LIKENESS = np.append(np.exp(-0.5 * (np.arange(16 * LIKENESS_STEPS) + 0.5) / LIKENESS_STEPS), 0).astype(np.float32)
"""Likeness by squared distance of colours, in such steps of a variance, 0 from the last one on: computing powers took
a quarter of the time.
"""
LEAST_WEIGHT = 0.05
"""Weight of all pixels of a surface together, below which its colours are not known."""
ALIKE, LIKE_NEIGHBOUR = 0.5, 0.6
"""Standard deviations of likeness, of a pixel to a surface and to a neighbour, in mean steps of colour in rims."""
UNLIKE, UNSEEN_WEIGHT = 0.03, 0.3
"""Likelihood of a colour that nothing on a surface has; weight of that possibility against what was seen."""
COHESION = 1.2
"""How much a neighbour on the same surface counts, in units of log likelihood."""
UNLIKE_NEIGHBOUR, DIAGONAL = 0.1, 0.7
"""Share of that for neighbours that do not look alike; factor for diagonal ones."""
CLEAR = 1.5
"""Log likelihood ratio from which colours are clear."""
RELUCTANCE = 0.7
"""How much the map counts against them: share of the log odds of its being right where they are clear."""
MOST_MISLED = 0.15
"""Where colours contradict the map beside steps, and a pixel farther in this share as often, they tell shade from
light rather than surfaces. ...
"""
TALL_EDGES = 5.0
"""... Then steps of more than so many least edges are judged alone: lower ones of noisy maps are no outlines."""
ROUNDS, PASSES = 2, 12
"""Rims move by their width at most in a round; in each, so many passes of mean field (Kraehenbuehl and Koltun 2011)."""
MOST_PIECE_PIXELS = 1 << 12


def choose_sides(
    colors: FloatImage, values: FloatImage, unknown: NDArray[np.bool_], least_edge: float, should_stop: ShouldStop
) -> FloatImage:
    """The map (H, W), its rims on the sides of steps (larger than least_edge) that the photo (H, W, 3) says.

    unknown: (H, W), where the map says nothing by itself. Where colours do not tell surfaces apart, or tell shade from
    light only, it stays as it is. Raises Cancelled once should_stop is true.
    """
    least_step, reluctance = None, None
    for _ in range(ROUNDS):
        distance = step_distance(values, least_edge)
        # The pixels that tell whether colours mislead come first.
        near, far = np.flatnonzero(distance < RIM_PX), np.flatnonzero(distance == RIM_PX)
        pixels = np.concatenate((near, far))
        if not len(pixels):
            return values
        contrast = _mean_color_step(colors, pixels)
        trust = TRUST[distance] * np.where(unknown, FILLED_TRUST, np.float32(1))
        weigh = partial(_weigh_colors, colors, values, trust, least_edge, ALIKE * contrast)
        away, own, known = distance.reshape(-1)[pixels], values.reshape(-1)[pixels], ~unknown.reshape(-1)[pixels]
        weighed = _in_parts(weigh, near, should_stop)
        if least_step is None:
            step = np.where(known[: len(near)], np.abs(weighed[0] - own[: len(near)]), np.float32(0))
            least_step = _least_judged(step, weighed[1], away[: len(near)], least_edge)
        if least_step is None:
            return values
        other, evidence = map(np.concatenate, zip(weighed, _in_parts(weigh, far, should_stop), strict=True))
        is_judged = np.abs(other - own) > least_step
        if reluctance is None:
            contradicted = _contradicted(evidence[known & is_judged], away[known & is_judged])
            reluctance = np.asarray(RELUCTANCE * np.log((1 - contradicted) / contradicted), np.float32)
        drive = np.where(is_judged, evidence + np.where(known, reluctance[away], 0), np.float32(np.inf))
        belief = _mean_field(colors, values, pixels, other, drive, LIKE_NEIGHBOUR * contrast, should_stop)
        values = values.copy()
        values.reshape(-1)[pixels] = np.where(belief < 0.5, other, own)
    return values


def _in_parts(
    weigh: Callable[[NDArray[np.int64]], tuple[FloatImage, FloatImage]],
    pixels: NDArray[np.int64],
    should_stop: ShouldStop,
) -> tuple[FloatImage, FloatImage]:
    """What `_weigh_colors` says of pixels (N, flat indices)."""
    parts = [pixels[part] for part in pieces_of(max(len(pixels), 1), MOST_PIECE_PIXELS)]
    weighed = in_pieces(weigh, parts, should_stop, tiling.THREADS)
    return np.concatenate([pair[0] for pair in weighed]), np.concatenate([pair[1] for pair in weighed])


def step_distance(values: FloatImage, least_edge: float, reach_px: int = RIM_PX) -> NDArray[np.uint8]:
    """(H, W): how many pixels lie between each and the nearest step larger than least_edge; at most reach_px + 1."""
    distance = np.full(values.shape, reach_px + 1, np.uint8)
    _measure_distance(values, least_edge, reach_px, distance)
    return distance


def _mean_color_step(colors: FloatImage, pixels: NDArray[np.int64]) -> float:
    """Root mean square distance of these pixels' colours (flat indices) from those of the pixels after them."""
    flat = colors.reshape(-1, 3)
    steps = flat[pixels] - flat[np.minimum(pixels + 1, len(flat) - 1)]
    return max(float(np.sqrt(np.nanmean(np.square(steps, dtype=np.float64).sum(axis=1)))), 1e-3)


def _contradicted(evidence: FloatImage, away: NDArray[np.uint8]) -> NDArray[np.float64]:
    """(RIM_PX + 1): in what share of the pixels so far from a step, with clear colours, these contradict the map."""
    shares = np.empty(RIM_PX + 1)
    for k in range(RIM_PX + 1):
        clear = evidence[(away == k) & (np.abs(evidence) > CLEAR)]
        shares[k] = (np.count_nonzero(clear < 0) + 1) / (len(clear) + 20)
    return shares


def _least_judged(step: FloatImage, evidence: FloatImage, away: NDArray[np.uint8], least_edge: float) -> float | None:
    """Steps of more than this are judged by colours; None: these mislead."""
    for least_step in (0.0, TALL_EDGES * least_edge):
        shares = _contradicted(evidence[step > least_step], away[step > least_step])
        if shares[1] <= MOST_MISLED * shares[0]:
            return least_step
    return None


def _mean_field(
    colors: FloatImage,
    values: FloatImage,
    pixels: NDArray[np.int64],
    other: FloatImage,
    drive: FloatImage,
    alike: float,
    should_stop: ShouldStop,
) -> FloatImage:
    """(N): how likely each pixel (flat index) is on its own surface rather than on the other."""
    number = np.empty(values.shape, np.int32)
    number_pixels(pixels, number)
    belief = np.ones(len(pixels), np.float32)
    firsts = range(0, len(pixels), MOST_PIECE_PIXELS)
    for _ in range(PASSES):
        believed, belief = belief, np.empty_like(belief)
        work = partial(_believe, colors, values, pixels, number, other, drive, alike, believed, belief)
        in_pieces(work, firsts, should_stop, tiling.THREADS)
    return belief


@kernel
def _measure_distance(values, least_edge, reach, distance):
    """What `step_distance` returns, where that is less than distance (H, W) has."""
    height, width = values.shape
    for y in range(height):
        for x in range(width):
            for v, u in ((y, min(x + 1, width - 1)), (min(y + 1, height - 1), x)):
                if not abs(values[v, u] - values[y, x]) > least_edge:
                    continue
                for j in range(max(y - reach, 0), min(v + reach + 1, height)):
                    for i in range(max(x - reach, 0), min(u + reach + 1, width)):
                        away = np.uint8(max(y - j, j - v, x - i, i - u, 0))
                        distance[j, i] = min(distance[j, i], away)


@kernel
def _nearest_other(values, y, x, least_edge):
    """The disparity of the nearest pixel on another surface; the pixel's own where there is none within reach."""
    height, width = values.shape
    found, nearest = values[y, x], 2 * (RIM_PX + 1) ** 2 + 1
    for v in range(max(y - RIM_PX - 1, 0), min(y + RIM_PX + 2, height)):
        for u in range(max(x - RIM_PX - 1, 0), min(x + RIM_PX + 2, width)):
            away = (v - y) ** 2 + (u - x) ** 2
            if away < nearest and abs(values[v, u] - values[y, x]) > least_edge:
                found, nearest = values[v, u], away
    return found


@kernel
def _weigh_colors(colors, values, trust, least_edge, alike, pixels):
    """Of pixels (N, flat indices): the disparity of the other surface (N), and what the colours say (N): the log of
    the likelihood that the pixel is on its own surface over that of the other. Without another, its own and 0.
    trust (H, W): how much each pixel tells.
    """
    height, width = values.shape
    others, evidence = np.empty(len(pixels), np.float32), np.zeros(len(pixels), np.float32)
    steps, most = np.float32(LIKENESS_STEPS / (alike * alike)), np.float32(len(LIKENESS) - 1)
    for n in range(len(pixels)):
        y, x = pixels[n] // width, pixels[n] % width
        own, other = values[y, x], _nearest_other(values, y, x, least_edge)
        others[n] = own
        if other == own:
            continue
        half = np.float32(0.5) * abs(other - own)
        own_weight = own_like = other_weight = other_like = other_sum = 0.0
        for v in range(max(y - REACH_PX, 0), min(y + REACH_PX + 1, height)):
            for u in range(max(x - REACH_PX, 0), min(x + REACH_PX + 1, width)):
                w = NEARNESS[v - y + REACH_PX, u - x + REACH_PX] * trust[v, u]
                apart = np.float32(0.0)
                for c in range(3):
                    apart += (colors[v, u, c] - colors[y, x, c]) ** 2
                # Colours that are not finite are like no other.
                at = apart * steps
                like = w * LIKENESS[int(at if at < most else most)]
                # Sums without branches: which surface comes next nobody can foretell.
                to_own, to_other = abs(values[v, u] - own), abs(values[v, u] - other)
                is_own = to_own <= half and to_own <= to_other
                is_other = to_other <= half and not is_own
                own_weight += w if is_own else 0.0
                own_like += like if is_own else 0.0
                other_weight += w if is_other else 0.0
                other_like += like if is_other else 0.0
                other_sum += w * (values[v, u] - other) if is_other else 0.0
        if other_weight > LEAST_WEIGHT:
            others[n] = other + other_sum / other_weight
            on_own = (own_like + UNSEEN_WEIGHT * UNLIKE) / (own_weight + UNSEEN_WEIGHT)
            on_other = (other_like + UNSEEN_WEIGHT * UNLIKE) / (other_weight + UNSEEN_WEIGHT)
            evidence[n] = log((on_own + UNLIKE) / (on_other + UNLIKE))
    return others, evidence


@kernel
def _believe(colors, values, pixels, number, other, drive, alike, believed, belief, first):
    """One pass of mean field over MOST_PIECE_PIXELS pixels from the first on: their belief by the neighbours'."""
    height, width = values.shape
    for n in range(first, min(first + MOST_PIECE_PIXELS, len(pixels))):
        y, x = pixels[n] // width, pixels[n] % width
        own, half = values[y, x], 0.5 * abs(other[n] - values[y, x])
        belief[n] = 1.0
        if half == 0:
            continue
        total = np.float64(drive[n])
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if v == y and u == x:
                    continue
                # On its own surface a neighbour votes for whichever of both that is, on its other one likewise.
                k = number[v, u]
                stays, elsewhere = (float(believed[k]), other[k]) if k >= 0 else (1.0, values[v, u])
                votes = 0.0
                if abs(values[v, u] - own) <= half:
                    votes += stays
                elif abs(values[v, u] - other[n]) <= half:
                    votes -= stays
                if abs(elsewhere - own) <= half:
                    votes += 1.0 - stays
                elif abs(elsewhere - other[n]) <= half:
                    votes -= 1.0 - stays
                apart = np.float32(0.0)
                for c in range(3):
                    apart += (colors[v, u, c] - colors[y, x, c]) ** 2
                like = exp(-0.5 * apart / (alike * alike)) if apart < np.inf else 0.0
                total += COHESION * (like + UNLIKE_NEIGHBOUR) * (1.0 if v == y or u == x else DIAGONAL) * votes
        belief[n] = 1.0 / (1.0 + exp(-min(max(total, -30.0), 30.0)))
