"""Contested rays: target rays near which several surfaces land, so that someone has to decide between them.

For each of them K hypotheses are laid out: surfaces that land within a few pixels, as different from each other as
possible. A hypothesis says "this ray shows the source ray that disparity d leads to"; its features say how well that
agrees with the disparity that the source ray really has. This is what a trained T decides on; colours are never among
the features.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.candidates import Candidates
from iibr_core.kernels import kernel, linear_scalar, nearest_pixel, srgb_scalar
from iibr_core.lookup import SOLE, look_up
from iibr_core.rays import RaySet
from iibr_core.types import FloatImage

HYPOTHESES = 5
REACH_PX = 3
"""Surfaces that land within this many pixels, each way, are considered."""
CONTESTED_PX = 0.75
"""Surfaces whose look-ups differ by less than this do not contest a ray."""
DISTINCT_PX = 0.3
"""Hypotheses closer than this are one."""
SOURCE_REACH_PX = 2
"""The surroundings of a source ray that its features describe."""
LEAST_WEIGHT = 0.02
INPAINTED_APART_PX = 100.0
"""What is inpainted and what the photo shows are different hypotheses, however close their disparities."""
PROFILE_PX = (-4.0, -2.5, -1.0, 1.0, 2.5, 4.0)
"""Where the disparity around a source ray is sampled, along the parallax and across it."""
FEATURES = 11 + 2 * len(PROFILE_PX)
SHARE = 6
"""The feature that is the closed form's weight."""


@dataclass(frozen=True, eq=False)
class Contested:
    """Contested rays (N) of one view and their hypotheses (K).

    pixel (N, 2): (row within the candidates, column). mask (N, K): hypotheses in use. disparity (N, K). source (N, K).
    features (N, K, FEATURES). colors (N, K, 3), sRGB-encoded.
    """

    pixel: NDArray[np.int64]
    mask: NDArray[np.bool_]
    disparity: FloatImage
    source: NDArray[np.uint8]
    features: FloatImage
    colors: FloatImage


def find_contested(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    rows: tuple[int, int],
    occluded: NDArray[np.bool_],
    every: bool = False,
) -> Contested:
    """The contested rays in rows [first, last) of these candidates, which should reach REACH_PX rows beyond them.

    occluded (as the candidates): rays to leave out, nothing shows them. every: take all others, contested or not.
    """
    first, last = rows
    shape = (last - first) * candidates.count.shape[1], HYPOTHESES
    pixel, number = np.empty((shape[0], 2), np.int64), np.zeros(shape[0], np.int64)
    disparity, source = np.zeros(shape, np.float32), np.zeros(shape, np.uint8)
    share = np.zeros(shape, np.float32)
    least = -1.0 if every else CONTESTED_PX
    t, s = candidates.offset
    parallax = max(abs(t), abs(s), 1e-9)
    count = _lay_out(
        candidates.count, candidates.disparity, candidates.source, weights, occluded, rays.photo_images, parallax,
        least, first, last, pixel, number, disparity, source, share,
    )  # fmt: skip
    pixel, number, disparity, source = pixel[:count], number[:count], disparity[:count], source[:count]
    share = share[:count]
    features = np.zeros((count, HYPOTHESES, FEATURES), np.float32)
    colors = np.zeros((count, HYPOTHESES, 3), np.float32)
    offsets, images, surfaces, coverage, _, _, _ = rays.arrays
    _describe(
        images, surfaces, coverage, np.array(candidates.offset) - offsets, rays.photo_images, candidates.first_row,
        candidates.count, candidates.disparity, candidates.source, weights,
        pixel, number, disparity, source, share, parallax, features, colors,
    )  # fmt: skip
    mask = np.arange(HYPOTHESES) < number[:, None]
    return Contested(pixel, mask, disparity, source, features, colors)


def decide(contested: Contested, weights: FloatImage) -> tuple[FloatImage, FloatImage, NDArray[np.uint8]]:
    """Colours (N, 3), disparity (N) and source (N) of contested rays for weights (N, K) whose rows sum to 1.

    Colours are summed in linear light; disparity and source are the heaviest hypothesis's.
    """
    colors = np.empty((len(weights), 3), np.float32)
    _blend(weights, contested.colors, colors)
    heaviest = weights.argmax(axis=1)[:, None]
    return (
        colors,
        np.take_along_axis(contested.disparity, heaviest, axis=1)[:, 0],
        np.take_along_axis(contested.source, heaviest, axis=1)[:, 0],
    )


@kernel
def _blend(weights, votes, colors):  # type: ignore[no-untyped-def]
    for n in range(len(weights)):
        heaviest = weights[n].max()
        for c in range(3):
            total = 0.0
            for a in range(weights.shape[1]):
                if weights[n, a] > SOLE:
                    total = votes[n, a, c]
                    break
                if weights[n, a] > 1.0 - SOLE:
                    total += weights[n, a] * linear_scalar(votes[n, a, c])
            colors[n, c] = total if heaviest > SOLE else srgb_scalar(total)


@kernel
def _lay_out(  # type: ignore[no-untyped-def]
    count, surface, origin, weights, occluded, photo_images, parallax, least, first, last,
    pixel, number, disparity, source, share,
):  # fmt: skip
    """Select contested rays; pick the surfaces on each, then again and again the one around it farthest from those."""
    _, rows, width = surface.shape
    most = 3 * (2 * REACH_PX + 1) ** 2
    near_d, near_k = np.empty(most), np.empty(most, np.int64)
    found = 0
    for y in range(first, last):
        for x in range(width):
            if occluded[y, x]:
                continue
            n = 0
            low, high = np.inf, -np.inf
            for v in range(max(y - REACH_PX, 0), min(y + REACH_PX + 1, rows)):
                for u in range(max(x - REACH_PX, 0), min(x + REACH_PX + 1, width)):
                    for k in range(np.int64(min(count[v, u], 3))):
                        if weights[k, v, u] > LEAST_WEIGHT or (u == x and v == y):
                            near_d[n], near_k[n] = surface[k, v, u], origin[k, v, u]
                            low, high = min(low, near_d[n]), max(high, near_d[n])
                            n += 1
            if n == 0 or (high - low) * parallax < least:
                continue
            picked = 0
            for k in range(np.int64(count[y, x])):
                if weights[k, y, x] > LEAST_WEIGHT and picked < disparity.shape[1]:
                    disparity[found, picked], source[found, picked] = surface[k, y, x], origin[k, y, x]
                    share[found, picked] = weights[k, y, x]
                    picked += 1
            if picked == 0:
                front = np.argmax(near_d[:n])
                disparity[found, 0], source[found, 0] = near_d[front], near_k[front]
                picked = 1
            while picked < disparity.shape[1]:
                best, best_distance = -1, DISTINCT_PX
                for i in range(n):
                    distance = np.inf
                    for j in range(picked):
                        apart = abs(near_d[i] - disparity[found, j]) * parallax
                        if (near_k[i] >= photo_images) != (source[found, j] >= photo_images):
                            apart += INPAINTED_APART_PX
                        distance = min(distance, apart)
                    if distance > best_distance:
                        best, best_distance = i, distance
                if best < 0:
                    break
                disparity[found, picked], source[found, picked] = near_d[best], near_k[best]
                picked += 1
            pixel[found, 0], pixel[found, 1], number[found] = y, x, picked
            found += 1
    return found


@kernel
def _squashed(px):  # type: ignore[no-untyped-def]
    """Pixels on a scale where small differences count most: finite and bounded for every input."""
    if np.isnan(px):
        return 0.0
    return np.sign(px) * np.log1p(min(abs(px), 1e4))


@kernel
def _describe(  # type: ignore[no-untyped-def]
    images, surfaces, coverage, offsets, photo_images, first_row, count, surface, origin, weights,
    pixel, number, disparity, source, share, parallax, features, colors,
):  # fmt: skip
    _, height, width = surfaces.shape
    rows = count.shape[0]
    for n in range(len(pixel)):
        y, x = pixel[n]
        high = disparity[n, 0]
        low = high
        for a in range(number[n]):
            low, high = min(low, disparity[n, a]), max(high, disparity[n, a])
        for a in range(number[n]):
            d, k = disparity[n, a], np.int64(source[n, a])
            t, s = offsets[k, 0], offsets[k, 1]
            source_x = min(max(x + d * s, -0.5), width - 0.5)
            source_y = min(max(first_row + y + d * t, -0.5), height - 0.5)
            r, g, b = look_up(images, surfaces, k, source_x, source_y, d, max(abs(s), abs(t), 1e-9))
            colors[n, a, 0], colors[n, a, 1], colors[n, a, 2] = max(r, 0.0), max(g, 0.0), max(b, 0.0)

            # The source ray's own disparity, bilinear, and the range of disparities around it.
            column, row = floor(source_x), floor(source_y)
            fx, fy = source_x - column, source_y - row
            own = total = 0.0
            for j in range(2):
                for i in range(2):
                    v, u = min(max(row + j, 0), height - 1), min(max(column + i, 0), width - 1)
                    w = (fx if i else 1.0 - fx) * (fy if j else 1.0 - fy)
                    if surfaces[k, v, u] == surfaces[k, v, u]:
                        own, total = own + w * surfaces[k, v, u], total + w
            own = own / total if total > 0 else d
            around_low = around_high = d
            centre_x, centre_y = nearest_pixel(source_x), nearest_pixel(source_y)
            for v in range(max(centre_y - SOURCE_REACH_PX, 0), min(centre_y + SOURCE_REACH_PX + 1, height)):
                for u in range(max(centre_x - SOURCE_REACH_PX, 0), min(centre_x + SOURCE_REACH_PX + 1, width)):
                    around_low, around_high = min(around_low, surfaces[k, v, u]), max(around_high, surfaces[k, v, u])

            along = max(np.hypot(s, t), 1e-9)
            for i in range(len(PROFILE_PX)):
                step_x, step_y = PROFILE_PX[i] * s / along, PROFILE_PX[i] * t / along
                for j in range(2):
                    v = min(max(nearest_pixel(source_y + (step_x if j else step_y)), 0), height - 1)
                    u = min(max(nearest_pixel(source_x + (-step_y if j else step_x)), 0), width - 1)
                    features[n, a, 11 + 2 * i + j] = _squashed((surfaces[k, v, u] - d) * parallax)

            # The nearest landing of this surface.
            nearest = REACH_PX + 1.0
            for v in range(max(y - REACH_PX, 0), min(y + REACH_PX + 1, rows)):
                for u in range(max(x - REACH_PX, 0), min(x + REACH_PX + 1, width)):
                    for i in range(np.int64(min(count[v, u], 3))):
                        if weights[i, v, u] > 0.5 and abs(surface[i, v, u] - d) * parallax < CONTESTED_PX:
                            nearest = min(nearest, np.sqrt((v - y) ** 2 + (u - x) ** 2))

            out = features[n, a]
            out[0] = _squashed((d - own) * parallax)
            out[1] = _squashed((around_high - d) * parallax)
            out[2] = _squashed((d - around_low) * parallax)
            out[3] = (own - around_low) / max(around_high - around_low, 1e-6)
            out[4] = _squashed((high - d) * parallax)
            out[5] = _squashed((d - low) * parallax)
            out[SHARE] = share[n, a]
            out[7] = nearest / (REACH_PX + 1.0)
            out[8] = 1.0 if k >= photo_images else 0.0
            out[9] = np.log1p(parallax)
            out[10] = coverage[k, min(max(centre_y, 0), height - 1), min(max(centre_x, 0), width - 1)]
