"""Equation 1 of the paper, c = sum w c: every candidate looks its colour up in its own source by a backward warp,
continuously along its own slope.

Looking up with the surface's exact disparity, instead of moving colours about, keeps sub-pixel accuracy: candidates
of one surface agree, and the weights only have to pick the surface. Keys' cubic convolution (1981), on encoded values
(less ringing at highlights); surfaces that share a pixel are summed in linear light. Near depth edges only pixels of
the candidate's own surface count.
"""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.candidates import Candidates
from iibr_core.method.rays import RaySet
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar, srgb_scalar
from iibr_core.surfaces import SAME_SURFACE_PX
from iibr_core.types import FloatImage

KEYS_A = np.float32(-0.75)
"""The sharper of the usual cubic kernels; it scored as well as longer ones on held-out light fields."""
MIN_SOLE_SHARE = 1 - 1e-6
"""Share of the weights from which on a candidate is the only one."""
MIN_TAP_WEIGHT = 0.3
"""Cubic weight on the candidate's surface below which its nearest pixel is taken instead."""


class ShownRays(NamedTuple):
    """Colours (N, W, 3) of target rays, sRGB-encoded; disparity (N, W) and source (N, W) of the heaviest candidates."""

    colors: FloatImage
    disparity: FloatImage
    source: NDArray[np.uint8]


def look_up(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    wanted: NDArray[np.bool_] | None = None,
    into: tuple[FloatImage, int, int] | None = None,
) -> ShownRays:
    """Return what target rays show; rays without candidates are black, at disparity 0 of source 0.

    wanted (N, W): rays whose colours are looked up, all by default. into: array (N', W', 3) that gets the colours, and
    the row and column at which it begins.
    """
    shape = candidates.number.shape
    colors, top, left = into or (np.zeros((*shape, 3), np.float32), 0, 0)
    shown = ShownRays(colors, np.zeros(shape, np.float32), np.zeros(shape, np.uint8))
    remaining = np.ones(shape, np.bool_) if wanted is None else wanted.copy()
    arrays, to_view = rays.arrays, rays.to_view(candidates.offset)
    _look_up_smooth(arrays, to_view, candidates, remaining, top, left, shown)
    _look_up_others(arrays, to_view, candidates, weights, remaining, top, left, shown)
    return shown


@kernel
def keys_weights(f, a):
    """Return Keys' weights of the pixels at -1, 0, 1, 2 for a position f in [0, 1); single precision if f and a are."""
    # Keys 1981: (a + 2) |t|^3 - (a + 3) |t|^2 + 1 up to one pixel away, a (|t|^3 - 5 |t|^2 + 8 |t| - 4) up to two.
    one, steep, bent = np.float32(1.0), a + np.float32(2.0), a + np.float32(3.0)
    g = one - f
    return a * f * g * g, one - f * f * (bent - steep * f), one - g * g * (bent - steep * g), a * g * f * f


@kernel
def cubic(images, index, x, y):
    """Return the colour at a position of one image; its border is repeated beyond it."""
    _, height, width, _ = images.shape
    column, row = floor(x), floor(y)
    (x0, x1, x2, x3), weight_y = keys_weights(x - column, KEYS_A), keys_weights(y - row, KEYS_A)
    # Columns of the four taps; the border pixel is repeated.
    a, b = max(column - 1, 0), max(column, 0)
    c, d = min(column + 1, width - 1), min(column + 2, width - 1)
    red = green = blue = 0.0
    # Rows: the products of both kernels; loops over taps and channels are written out for speed.
    for j in range(4):
        v, w = min(max(row - 1 + j, 0), height - 1), weight_y[j]
        red += w * (
            x0 * images[index, v, a, 0] + x1 * images[index, v, b, 0]
            + x2 * images[index, v, c, 0] + x3 * images[index, v, d, 0]
        )  # fmt: skip
        green += w * (
            x0 * images[index, v, a, 1] + x1 * images[index, v, b, 1]
            + x2 * images[index, v, c, 1] + x3 * images[index, v, d, 1]
        )  # fmt: skip
        blue += w * (
            x0 * images[index, v, a, 2] + x1 * images[index, v, b, 2]
            + x2 * images[index, v, c, 2] + x3 * images[index, v, d, 2]
        )  # fmt: skip
    return red, green, blue


@kernel
def cubic_on_surface(images, surfaces, index, x, y, d, parallax):
    """Return the colour at a position from the pixels of disparity d, within their range if some are missing."""
    _, height, width = surfaces.shape
    k, own, tolerance = np.uint64(index), np.float32(d), np.float32(SAME_SURFACE_PX / parallax)
    column, row = floor(x), floor(y)
    weight_x = keys_weights(np.float32(x - column), KEYS_A)
    weight_y = keys_weights(np.float32(y - row), KEYS_A)
    # Sums over the taps of the own surface, and their range; single precision is far finer than an 8-bit step.
    total = red = green = blue = np.float32(0.0)
    low_r = low_g = low_b = np.float32(np.inf)
    high_r = high_g = high_b = np.float32(-np.inf)
    near_r = near_g = near_b = np.float32(0.0)
    taps, nearest = 0, np.inf
    for j in range(4):
        v, wy = np.uint64(min(max(row - 1 + j, 0), height - 1)), weight_y[j]
        for i in range(4):
            u = np.uint64(min(max(column - 1 + i, 0), width - 1))
            # Another surface, or none: NaN fails the comparison.
            if abs(surfaces[k, v, u] - own) <= tolerance:
                w = weight_x[i] * wy
                r, g, b = images[k, v, u, 0], images[k, v, u, 1], images[k, v, u, 2]
                total, red, green, blue = total + w, red + w * r, green + w * g, blue + w * b
                low_r, low_g, low_b = min(low_r, r), min(low_g, g), min(low_b, b)
                high_r, high_g, high_b = max(high_r, r), max(high_g, g), max(high_b, b)
                distance = (np.int64(u) - x) ** 2 + (np.int64(v) - y) ** 2
                if distance < nearest:
                    nearest, near_r, near_g, near_b = distance, r, g, b
                taps += 1
    # The whole kernel: its weights sum to 1, and it may overshoot as everywhere.
    if taps == 16:
        return np.float64(red), np.float64(green), np.float64(blue)
    # No tap lies on the surface: the plain kernel is used.
    if taps == 0:
        return cubic(images, index, x, y)
    # Next to no weight, or a negative one, is left: dividing by it would blow up noise.
    if total < MIN_TAP_WEIGHT:
        return np.float64(near_r), np.float64(near_g), np.float64(near_b)
    # Normalised over the remaining taps. Without the other lobes it may overshoot, so it is clipped to their range.
    return (
        np.float64(min(max(red / total, low_r), high_r)),
        np.float64(min(max(green / total, low_g), high_g)),
        np.float64(min(max(blue / total, low_b), high_b)),
    )


@kernel
def _look_up_smooth(rays, offsets, candidates, remaining, first_y, first_x, shown):
    """Look up the easiest rays, which are most of them: those with one candidate and no edge or border near it.

    They are cleared in `remaining`. All rays with one candidate get their disparity and source.
    """
    images, near_edge, first_row, count = rays.colors, rays.near_edge, candidates.first_row, candidates.number
    candidate_disparity, candidate_source = candidates.disparity[0], candidates.source[0]
    disparity, source = shown.disparity, shown.source
    _, height, width, _ = images.shape
    flat, colors, shown_width = images.reshape(-1), shown.colors.reshape(-1), shown.colors.shape[1]
    # Per ray of the row: index of its source pixel (-1 if it is not looked up here); fractional offsets, per channel.
    begin = np.empty(count.shape[1], np.int64)
    across, down = np.empty(3 * count.shape[1], np.float32), np.empty(3 * count.shape[1], np.float32)
    for row in range(count.shape[0]):
        for x in range(count.shape[1]):
            begin[x] = -1
            if count[row, x] != 1:
                continue
            d, k = candidate_disparity[row, x], np.uint64(candidate_source[row, x])
            disparity[row, x], source[row, x] = d, k
            if not remaining[row, x]:
                continue
            # Backward warp: the point of the source that this ray shows.
            source_x, source_y = x + d * offsets[k, 1], first_row + row + d * offsets[k, 0]
            # All 16 taps inside the picture and on one surface.
            if not (1 <= source_x < width - 2 and 1 <= source_y < height - 2):
                continue
            # By way of signed integers: from and to floats those are converted faster.
            left, top = int(source_x), int(source_y)
            if near_edge[k, np.uint64(top), np.uint64(left)]:
                continue
            remaining[row, x] = False
            begin[x] = 3 * ((np.int64(k) * height + top) * width + left)
            fx, fy = np.float32(source_x - left), np.float32(source_y - top)
            across[3 * x], across[3 * x + 1], across[3 * x + 2] = fx, fx, fx
            down[3 * x], down[3 * x + 1], down[3 * x + 2] = fy, fy, fy
        # Rays side by side that look at pixels side by side: all their channels at once.
        x = 0
        while x < count.shape[1]:
            end = x + 1
            if begin[x] >= 0:
                while end < count.shape[1] and begin[end] - begin[x] == 3 * (end - x):
                    end += 1
                to = 3 * ((row - first_y) * shown_width + x - first_x)
                _look_up_run(flat, begin[x], 3 * width, across, down, x, end, colors, to)
            x = end


@kernel
def _look_up_run(flat, begin, pitch, across, down, first, end, colors, to):
    """`cubic` written out, in single precision and without tests, for the rays [first, end) of a row. flat: all images'
    values; begin, pitch: where those of the first ray's pixel begin, and how far it is to the next row; to: where in
    colors they go.
    """
    three, six, nine = np.uint64(3), np.uint64(6), np.uint64(9)
    # Unsigned indices need no test for counting from the end: so the loop runs eight values at a time.
    a, to = np.uint64(begin - pitch - 3), np.uint64(to)
    b = a + np.uint64(pitch)
    c = b + np.uint64(pitch)
    d = c + np.uint64(pitch)
    at = np.uint64(3 * first)
    for i in range(np.uint64(3 * (end - first))):
        (x0, x1, x2, x3), (y0, y1, y2, y3) = keys_weights(across[at + i], KEYS_A), keys_weights(down[at + i], KEYS_A)
        # Separable: along the rows, then across them. Single precision is far finer than an 8-bit step.
        a_, b_, c_, d_ = a + i, b + i, c + i, d + i
        colors[to + i] = max(
            y0 * (x0 * flat[a_] + x1 * flat[a_ + three] + x2 * flat[a_ + six] + x3 * flat[a_ + nine])
            + y1 * (x0 * flat[b_] + x1 * flat[b_ + three] + x2 * flat[b_ + six] + x3 * flat[b_ + nine])
            + y2 * (x0 * flat[c_] + x1 * flat[c_ + three] + x2 * flat[c_ + six] + x3 * flat[c_ + nine])
            + y3 * (x0 * flat[d_] + x1 * flat[d_ + three] + x2 * flat[d_ + six] + x3 * flat[d_ + nine]),
            np.float32(0.0),
        )


@kernel
def _look_up_others(rays, offsets, candidates, weights, wanted, first_y, first_x, shown):
    """Look up the remaining rays, see `look_up`. offsets (S, 2): from each source to the target view."""
    images, surfaces, near_edge = rays.colors, rays.disparity, rays.near_edge
    first_row, count = candidates.first_row, candidates.number
    candidate_disparity, candidate_source = candidates.disparity, candidates.source
    colors, disparity, source = shown.colors, shown.disparity, shown.source
    _, height, width, _ = images.shape
    for row in range(count.shape[0]):
        for x in range(count.shape[1]):
            used = np.int64(count[row, x])
            if used < 2 and not wanted[row, x]:
                continue
            v, u = row - first_y, x - first_x
            if used == 0:
                colors[v, u, 0], colors[v, u, 1], colors[v, u, 2] = 0.0, 0.0, 0.0
                continue
            # The weights of a ray sum to its coverage; the heaviest candidate gives its disparity and source.
            total, heavy = 0.0, 0
            for k in range(used):
                total += weights[k, row, x]
                if weights[k, row, x] > weights[heavy, row, x]:
                    heavy = k
            disparity[row, x] = candidate_disparity[heavy, row, x]
            source[row, x] = candidate_source[heavy, row, x]
            if not wanted[row, x]:
                continue
            sole = weights[heavy, row, x] >= MIN_SOLE_SHARE * total
            sum_r = sum_g = sum_b = 0.0
            # Colours: the sum of w_k c_k over w_k > 0 (the paper's equation 1).
            for k in range(used):
                w = weights[k, row, x] / total
                if not w > 1.0 - MIN_SOLE_SHARE:
                    continue
                # Backward warp along the candidate's own slope, held at the border.
                d = candidate_disparity[k, row, x]
                index = np.int64(candidate_source[k, row, x])
                t, s = offsets[index, 0], offsets[index, 1]
                source_x = min(max(x + d * s, -0.5), width - 0.5)
                source_y = min(max(first_row + row + d * t, -0.5), height - 0.5)
                # Near an edge, only pixels of the same surface count; elsewhere the plain kernel needs no tests.
                parallax = max(abs(s), abs(t), 1e-9)
                if not near_edge[index, max(floor(source_y), 0), max(floor(source_x), 0)]:
                    r, g, b = cubic(images, index, source_x, source_y)
                else:
                    r, g, b = cubic_on_surface(images, surfaces, index, source_x, source_y, d, parallax)
                # A sole surface stays encoded; several are averaged in linear light, as their light adds up.
                if sole:
                    sum_r, sum_g, sum_b = max(r, 0.0), max(g, 0.0), max(b, 0.0)
                else:
                    sum_r += w * linear_scalar(r)
                    sum_g += w * linear_scalar(g)
                    sum_b += w * linear_scalar(b)
            if not sole:
                sum_r, sum_g, sum_b = srgb_scalar(sum_r), srgb_scalar(sum_g), srgb_scalar(sum_b)
            colors[v, u, 0], colors[v, u, 1], colors[v, u, 2] = sum_r, sum_g, sum_b
