"""The surface that each pixel beside a depth edge shows: a conditional random field over edge bands.

A pixel stays on its surface or takes the nearest other one. Three things count: the map, the pixel's colour (a kernel
density of the colours on either side; mixed colours belong to the foreground), and the neighbours that look alike. The
map's weight follows its errors, measured by how often colours contradict it, behind and in front of edges, by distance.
So exact maps keep their edges, and dilated, eroded, ragged and coarse maps get those of the photo.
"""

from __future__ import annotations

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

BAND_PX = 4
"""Largest number of pixels between a labelled pixel and a step; at this distance, colours should agree with the map."""
SAMPLED_PX, SAMPLE_STEP = 8, 2
"""Distance in which every second pixel, in both directions, is a sample of its surface's colours, in pixels."""
SAMPLE_WEIGHTS = np.append(np.geomspace(0.1, 1.0, BAND_PX + 1), 1.0).astype(np.float32)
"""Weights of samples by the pixels between them and a step: near ones are mixed, or on the wrong side."""
MIN_FOREGROUND = 0.7
"""Least total weight of a foreground's samples: a thinner foreground keeps its pixels."""
LIKENESS = 0.5
"""Standard deviation of colours that are alike, in mean steps of colour in the band."""
UNLIKELY, UNSEEN_WEIGHT = 0.03, 0.3
"""Likelihood of a colour that no sample has, and weight of that possibility; also the least share of map errors."""
NEIGHBOUR_WEIGHT = 1.5
"""Weight of a neighbour that looks alike, and of the map's log odds, in units of log likelihood of the colours. Colours
are clear if they count more than a neighbour. With a smaller weight, thin wires are lost.
"""
MIXED_SHARES = (0.1, 0.25)
"""Shares of the pixels just behind and just in front of exact steps whose mixed colours contradict the map."""
MIN_CLEAR_SHARE = 0.2
"""Least share of pixels with clear colours from which the map is judged, and largest share of contradictions inside
surfaces over those beside steps: colours that exceed it part light from shade.
"""
MAX_EXACT_ERRORS = 0.1
"""Largest share of errors in a map that stays unchanged."""
PASSES = 8
"""Number of passes of mean field (Kraehenbuehl and Koltun 2011)."""
PIECE_PIXELS = 1 << 12
"""Number of pixels that are labelled between two checks for cancellation."""


def _places_around(reach_px: int) -> NDArray[np.int64]:
    """Return rows and columns (N, 2) from a pixel to those around it, nearest first."""
    places = np.indices((2 * reach_px + 1,) * 2).reshape(2, -1).T - reach_px
    return np.ascontiguousarray(places[np.argsort((places**2).sum(axis=1), kind="stable")][1:])


def _sample_weights() -> FloatImage:
    """Return the weights of samples by place, (2 SAMPLED_PX + 1, 2 SAMPLED_PX + 1); 0 for the pixel in the middle."""
    weights = nearness(SAMPLED_PX, SAMPLED_PX / 2).astype(np.float32)
    weights[SAMPLED_PX, SAMPLED_PX] = 0
    return weights


AROUND = _places_around(BAND_PX + 1)
"""Places in which a pixel's other surface is searched. The first eight touch the pixel."""
NEARNESS = _sample_weights()


def label_edges(colors: FloatImage, values: FloatImage, unknown: NDArray[np.bool_], min_edge: float) -> FloatImage:
    """Return the map with every pixel beside a step on the side that the photo shows.

    colors: (H, W, 3), sRGB-encoded. values: (H, W); returned unchanged if colours contradict the map no more often than
    an exact one. unknown: (H, W), pixels whose value was filled in. min_edge: disparity difference of a step, at least.
    """
    distance = step_distance(values, min_edge)
    pixels = np.flatnonzero(distance <= BAND_PX)
    if not len(pixels):
        return values
    alike = LIKENESS * _mean_color_step(colors, pixels)
    weigh = partial(_weigh_colors, colors, values, SAMPLE_WEIGHTS[distance], min_edge, alike)
    flat, away, known = values.reshape(-1), distance.reshape(-1), ~unknown.reshape(-1)
    few = pixels[:: ceil(len(pixels) / (4 * PIECE_PIXELS))]
    other, evidence = _in_parts(weigh, few)
    errors = _measure_errors(evidence, flat[few] > other, away[few], known[few])
    if errors.max() <= MAX_EXACT_ERRORS:
        return values
    other, evidence = _in_parts(weigh, pixels)
    odds = np.float32(NEIGHBOUR_WEIGHT) * np.log((1 - errors) / errors)
    prior = np.where(known[pixels], odds[(flat[pixels] > other).astype(np.intp), away[pixels]], np.float32(0))
    drive = np.where(other == flat[pixels], np.float32(np.inf), evidence + prior)
    stays = _mean_field(colors, values, pixels, other, drive, alike) >= 0.5
    labelled = values.copy()
    labelled.reshape(-1)[pixels] = np.where(stays, flat[pixels], other)
    return labelled


def step_distance(
    values: FloatImage, min_edge: float, reach_px: int = BAND_PX, counts_slopes: bool = False
) -> NDArray[np.uint8]:
    """Return the number of pixels between each pixel and the nearest step, (H, W); at most reach_px + 1.

    counts_slopes: whether steps count that continue before and after.
    """
    distance = np.full(values.shape, reach_px + 1, np.uint8)
    _mark_steps(values, min_edge, counts_slopes, distance)
    _spread(distance)
    _spread(distance[::-1, ::-1])
    return distance


def _mean_color_step(colors: FloatImage, pixels: NDArray[np.int64]) -> float:
    """Return the root mean square difference of colour between pixels (flat indices) and the pixels after them."""
    flat = colors.reshape(-1, 3)
    steps = flat[pixels] - flat[np.minimum(pixels + 1, len(flat) - 1)]
    return max(float(np.sqrt(np.nanmean(np.square(steps, dtype=np.float64).sum(axis=1)))), 1e-3)


def _in_parts(weigh: partial[tuple[FloatImage, FloatImage]], pixels: NDArray[np.int64]) -> list[FloatImage]:
    """Return the results of `_weigh_colors` for pixels (N, flat indices)."""
    parts = [pixels[part] for part in pieces_of(len(pixels), PIECE_PIXELS)]
    return [np.concatenate(column) for column in zip(*in_pieces(weigh, parts, tiling.THREADS), strict=True)]


def _measure_errors(
    evidence: FloatImage, in_front: NDArray[np.bool_], away: NDArray[np.uint8], known: NDArray[np.bool_]
) -> FloatImage:
    """Return the share of pixels on the wrong side, (2, BAND_PX + 1): behind and in front of a step, by distance.

    Contradictions count beyond those inside surfaces and those of the mixed pixels of exact steps.
    """
    errors = np.full((2, BAND_PX + 1), UNLIKELY, np.float32)
    is_clear = known & (np.abs(evidence) > NEIGHBOUR_WEIGHT)
    for side in range(2):
        misled = _contradicted(evidence[is_clear & (in_front == side) & (away == BAND_PX)])
        for k in range(BAND_PX + 1):
            by_chance = max(misled, MIXED_SHARES[side]) if k == 0 else misled
            here = known & (in_front == side) & (away == k)
            clear = evidence[here & is_clear]
            contradicted = _contradicted(clear, misled)
            is_judged = len(clear) >= MIN_CLEAR_SHARE * np.count_nonzero(here)
            if is_judged and misled <= MIN_CLEAR_SHARE * contradicted:
                errors[side, k] = (contradicted - by_chance) / max(1 - misled - by_chance, 0.1)
    return np.clip(errors, UNLIKELY, 1 - UNLIKELY)


def _contradicted(evidence: FloatImage, expected: float = 0.05) -> float:
    """Return the share of pixels whose colours contradict the map; of few pixels, about the expected share."""
    return (np.count_nonzero(evidence < 0) + 20 * expected) / (len(evidence) + 20)


def _mean_field(
    colors: FloatImage,
    values: FloatImage,
    pixels: NDArray[np.int64],
    other: FloatImage,
    drive: FloatImage,
    alike: float,
) -> FloatImage:
    """Return the probability that each pixel (N, flat indices) stays on its surface."""
    number = np.full(values.shape, -1, np.int32)
    number_pixels(pixels, number)
    drive, votes = drive.copy(), np.empty((len(pixels), 8), np.float32)
    belief = np.ones(len(pixels), np.float32)
    firsts = range(0, len(pixels), PIECE_PIXELS)
    in_pieces(
        partial(_count_votes, colors, values, pixels, number, other, alike, (drive, votes)), firsts, tiling.THREADS
    )
    for _ in range(PASSES):
        previous, belief = belief, np.empty_like(belief)
        in_pieces(partial(_update_beliefs, pixels, number, drive, votes, previous, belief), firsts, tiling.THREADS)
    return belief


@kernel
def _is_slope(values, y, x, v, u, step):
    """Return whether the map rises or falls likewise before a pixel (y, x) and after the next pixel (v, u)."""
    height, width = values.shape
    above, left, below, right = 2 * y - v, 2 * x - u, 2 * v - y, 2 * u - x
    before = values[y, x] - values[above, left] if above >= 0 and left >= 0 else step
    after = values[below, right] - values[v, u] if below < height and right < width else step
    return min(before * step, after * step) >= SLOPE_SHARE * step * step


@kernel
def _mark_steps(values, min_edge, counts_slopes, distance):
    """Write 0 to the distance of pixels on both sides of steps."""
    height, width = values.shape
    for y in range(height):
        for x in range(width):
            for v, u in ((y, min(x + 1, width - 1)), (min(y + 1, height - 1), x)):
                step = values[v, u] - values[y, x]
                if abs(step) > min_edge and (counts_slopes or not _is_slope(values, y, x, v, u, step)):
                    distance[y, x] = distance[v, u] = 0


@kernel
def _spread(distance):
    """Limit each distance to one more than those above and to the left."""
    height, width = distance.shape
    for y in range(height):
        for x in range(width):
            left, right, above = max(x - 1, 0), min(x + 1, width - 1), max(y - 1, 0)
            least = min(distance[above, left], distance[above, x], distance[above, right], distance[y, left])
            distance[y, x] = min(distance[y, x], least + 1)


@kernel
def _nearest_other(values, y, x, min_edge):
    """Return the disparity of the nearest pixel on another surface; the pixel's if there is none."""
    height, width = values.shape
    for n in range(len(AROUND)):
        v, u = y + AROUND[n, 0], x + AROUND[n, 1]
        if 0 <= v < height and 0 <= u < width and not same_surface(values[v, u], values[y, x], min_edge):
            return values[v, u]
    return values[y, x]


@kernel
def _squared_distance(color, other):
    total = np.float32(0.0)
    for c in range(3):
        total += (color[c] - other[c]) ** 2
    return total


@kernel
def _likeness(squared_distance, alike):
    """Return a Gaussian weight by colour, 0..1; colours that are not finite are like no other."""
    return exp(-0.5 * squared_distance / (alike * alike)) if squared_distance < np.inf else 0.0


@kernel
def _weigh_colors(colors, values, trust, min_edge, alike, pixels):
    """Return the other surfaces' disparity (N) and the evidence of colours (N) for pixels (N, flat indices).

    Evidence is the log of the likelihood that a pixel is on its surface over that of the other; a pixel without another
    surface gets its disparity and 0. trust (H, W): weight of each pixel as a sample.
    """
    height, width = values.shape
    others, evidence = np.empty(len(pixels), np.float32), np.zeros(len(pixels), np.float32)
    # Sums over the samples of the pixel's surface and of the other: weights, likeness, colours, their squares.
    weight, like, total, squares = np.empty(2), np.empty(2), np.empty((2, 3)), np.empty(2)
    for n in range(len(pixels)):
        y, x = pixels[n] // width, pixels[n] % width
        value, other = values[y, x], _nearest_other(values, y, x, min_edge)
        others[n] = value
        if other == value:
            continue
        half = 0.5 * abs(other - value)
        weight[:], like[:], total[:], squares[:] = 0.0, 0.0, 0.0, 0.0
        for v in range(y - min(y, SAMPLED_PX) // 2 * 2, min(y + SAMPLED_PX + 1, height), SAMPLE_STEP):
            for u in range(x - min(x, SAMPLED_PX) // 2 * 2, min(x + SAMPLED_PX + 1, width), SAMPLE_STEP):
                to_value, to_other = abs(values[v, u] - value), abs(values[v, u] - other)
                if not min(to_value, to_other) <= half:  # a third surface
                    continue
                side = 0 if to_value <= to_other else 1
                w = NEARNESS[v - y + SAMPLED_PX, u - x + SAMPLED_PX] * trust[v, u]
                weight[side] += w
                like[side] += w * _likeness(_squared_distance(colors[v, u], colors[y, x]), alike)
                for c in range(3):
                    total[side, c] += w * colors[v, u, c]
                    squares[side] += w * colors[v, u, c] ** 2
        # A wire beside its place in the map has no samples of its colours: it would be lost.
        if not weight[1] > 0 or (value > other and weight[0] < MIN_FOREGROUND):
            continue
        others[n] = other
        back = 0 if other > value else 1
        for side in range(2):
            like[side] = (like[side] + UNSEEN_WEIGHT * UNLIKELY) / (weight[side] + UNSEEN_WEIGHT)
        if weight[0] > 0:
            mixed = _mixed_likelihood(colors[y, x], weight, total, squares[back], back, alike)
            like[1 - back] = max(like[1 - back], mixed)
        evidence[n] = log((like[0] + UNLIKELY) / (like[1] + UNLIKELY))
    return others, evidence


@kernel
def _mixed_likelihood(color, weight, total, back_squares, back, alike):
    """Return the likelihood that a colour mixes both surfaces' mean colours, if all shares are equally likely.

    0 if the foreground's share is lost in the spread of the background's colours. weight (2), total (2, 3): see
    `_weigh_colors`. back: index of the background.
    """
    contrast = along = away = 0.0
    spread = back_squares / weight[back]
    for c in range(3):
        behind = total[back, c] / weight[back]
        step, offset = total[1 - back, c] / weight[1 - back] - behind, color[c] - behind
        contrast, along, away = contrast + step * step, along + step * offset, away + offset * offset
        spread -= behind * behind
    if not contrast > 1e-9:
        return 0.0
    share = along / contrast
    if not sqrt(max(spread, 0.0) / contrast) < share < 1.0:
        return 0.0
    return _likeness(max(away - along * share, 0.0), alike) * min(sqrt(2.0 * np.pi / contrast) * alike, 1.0)


@kernel
def _count_votes(colors, values, pixels, number, other, alike, results, first):
    """Write the votes of eight neighbours (N, 8) for PIECE_PIXELS pixels from the first on.

    A neighbour's vote is its effect if it is on its surface rather than on its other one; its vote on the other one is
    added to drive (N). results: drive and votes.
    """
    (height, width), (drive, votes) = values.shape, results
    for n in range(first, min(first + PIECE_PIXELS, len(pixels))):
        y, x = pixels[n] // width, pixels[n] % width
        value, half = values[y, x], 0.5 * abs(other[n] - values[y, x])
        votes[n] = 0.0
        for j in range(8 if half > 0 else 0):
            v, u = y + AROUND[j, 0], x + AROUND[j, 1]
            if not (0 <= v < height and 0 <= u < width):
                continue
            k = number[v, u]
            stays = _side(values[v, u], value, other[n], half)
            leaves = _side(other[k], value, other[n], half) if k >= 0 else stays
            weight = NEIGHBOUR_WEIGHT * _likeness(_squared_distance(colors[v, u], colors[y, x]), alike)
            drive[n] += weight * leaves
            votes[n, j] = weight * (stays - leaves)


@kernel
def _side(disparity, value, other, half):
    """Return 1 for a disparity on a pixel's surface, -1 for the other surface, 0 for neither."""
    if same_surface(disparity, value, half):
        return 1.0
    return -1.0 if same_surface(disparity, other, half) else 0.0


@kernel
def _update_beliefs(pixels, number, drive, votes, previous, belief, first):
    """Write the probabilities of PIECE_PIXELS pixels from the first on, by the neighbours' previous ones."""
    width = number.shape[1]
    for n in range(first, min(first + PIECE_PIXELS, len(pixels))):
        y, x = pixels[n] // width, pixels[n] % width
        total = drive[n]
        for j in range(8):
            if votes[n, j] != 0:
                total += votes[n, j] * previous[number[y + AROUND[j, 0], x + AROUND[j, 1]]]
        belief[n] = 1.0 / (1.0 + exp(-min(max(total, -30.0), 30.0)))
