"""A sharpened map, blurred again, should give the map that it was made of: where it does not, its edges move.

Ramps cut at half their height leave corners round and outlines ragged: what the blurred map misses shows it.
"""

from __future__ import annotations

from math import ceil

import numpy as np

from iibr_core.depth.edges.edge_profiles import COLOR_NOISE, GAUSSIAN_SIGMAS
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import same_surface
from iibr_core.types import FloatImage, image_size

WIDEST_FITTED_SIGMA_PX = 4.5
"""Work grows with the blur's area: wider ones stay as they are."""
DESCENT_SWEEPS = 4
"""Of moving edges."""
REVISIT_RADIUS_PX = 2
"""Beside a pixel that moved, so far around, the next sweep looks again."""
COLOR_WEIGHT = 6.0
"""What a colour that is clearly one side's counts, in what a whole pixel on the wrong side adds to the misfit; each of
the eight neighbours that is on the other side counts 1.
"""
FULL_WEIGHT_SIGMA_PX = 2.0
"""Blur from which colours and outline count in full: the narrower, the better the map itself shows where its edges are,
by the square.
"""
MOVED_EDGES = 2.0
"""Times the least edge: lower steps stay where they are."""
SAME_SIDE = 0.3
"""Of the step, up to which a height is that side's."""
COLOR_PX = 3
"""Colours of both sides are taken from so far around."""


def fit_to_blur(
    photo: FloatImage,
    values: FloatImage,
    sharp: FloatImage,
    sigma: float,
    least_edge: float,
) -> FloatImage:
    """The map `sharp` (H, W) with its edges moved so that, blurred by sigma (px), it gives `values` (H, W).

    photo: (H, W, 3), sRGB-encoded; it counts, too, in where an edge lies. least_edge: the step that counts as one.
    Edges move where `sharp` differs from `values`, and from there on.
    """
    if sigma > WIDEST_FITTED_SIGMA_PX:
        return sharp
    taps, weight = _taps(sigma), min((sigma / FULL_WEIGHT_SIGMA_PX) ** 2, 1.0)
    fitted, missing, settled = sharp.copy(), np.empty_like(sharp), sharp == values

    def find_missing(first: int, last: int) -> None:
        _find_missing(values, fitted, taps, first, last, missing)

    def move(first: int, last: int) -> None:
        _move_edges(photo, fitted, missing, taps, weight, MOVED_EDGES * least_edge, first, last, settled)

    in_bands(find_missing, image_size(values))
    for _ in range(DESCENT_SWEEPS):
        # One band after the other: each move sees what those before it left missing.
        in_bands(move, image_size(values), threads=1)
    return fitted


def _taps(sigma: float) -> FloatImage:
    """A Gaussian that sums to 1."""
    reach = ceil(GAUSSIAN_SIGMAS * sigma)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    return np.asarray(taps / taps.sum(), np.float32)


@kernel
def _find_missing(values, fitted, taps, first, last, missing):
    """Rows [first, last): the given map less the fitted one, blurred. The border's pixels go on."""
    height, width = values.shape
    far = len(taps) // 2
    line = np.empty(width + 2 * far, np.float32)
    for y in range(first, last):
        # Separable: columns, then rows.
        line[:] = 0.0
        for j in range(-far, far + 1):
            _add(taps[far + j], fitted[min(max(y + j, 0), height - 1)], line[far : far + width])
        line[:far], line[far + width :] = line[far], line[far + width - 1]
        missing[y] = values[y]
        for i in range(2 * far + 1):
            _add(-taps[i], line[i:], missing[y])


@kernel
def _add(factor, values, total):
    for x in range(len(total)):
        total[x] += factor * values[x]


@kernel
def _color_vote(photo, fitted, y, x, here, there, least_edge, sums):
    """Matting: the pixel's colour between those of both heights' surfaces around it; -1 here .. 1 there, nearer 0 the
    less sure.
    """
    height, width = fitted.shape
    near = max(SAME_SIDE * abs(there - here), least_edge)
    sums[:] = 0.0
    for v in range(max(y - COLOR_PX, 1), min(y + COLOR_PX, height - 2) + 1):
        for u in range(max(x - COLOR_PX, 1), min(x + COLOR_PX, width - 2) + 1):
            value, apart = fitted[v, u], (v - y) ** 2 + (u - x) ** 2
            side = 0 if abs(value - here) < near else 1
            # Pixels beside an edge are mixed.
            if (
                apart > 2
                and (side == 0 or abs(value - there) < near)
                and abs(fitted[v - 1, u] - value) < near
                and abs(fitted[v + 1, u] - value) < near
                and abs(fitted[v, u - 1] - value) < near
                and abs(fitted[v, u + 1] - value) < near
            ):
                weight = 1.0 / apart
                sums[side, 3] += weight
                for c in range(3):
                    sums[side, c] += weight * photo[v, u, c]
    if min(sums[0, 3], sums[1, 3]) == 0:
        return 0.0
    along = contrast = away = 0.0
    for c in range(3):
        origin = sums[0, c] / sums[0, 3]
        difference, own = sums[1, c] / sums[1, 3] - origin, photo[y, x, c] - origin
        along, contrast, away = along + own * difference, contrast + difference**2, away + own**2
    share = along / max(contrast, 1e-9)
    residual = max(away - share * along, 0.0)
    return 2.0 * (min(max(share, 0.0), 1.0) - 0.5) * contrast / (contrast + residual + COLOR_NOISE)


@kernel
def _same_surface_neighbours(fitted, y, x, here, there):
    """How many more of the eight neighbours have about the height `here` than `there`."""
    height, width = fitted.shape
    more, near = -1, 0.5 * abs(there - here)
    for j in range(-1, 2):
        for i in range(-1, 2):
            value = fitted[min(max(y + j, 0), height - 1), min(max(x + i, 0), width - 1)]
            more += same_surface(value, here, near) - same_surface(value, there, near)
    return more


@kernel
def _correlate(missing, y, x, taps, far):
    """What is missing about a pixel, weighted by the blur."""
    height, width = missing.shape
    total = 0.0
    for v in range(max(y - far, 0), min(y + far, height - 1) + 1):
        along, left, right = np.float32(0.0), max(x - far, 0), min(x + far, width - 1) + 1
        own, line = taps[left - x + far :], missing[v, left:right]
        for k in range(len(line)):
            along += own[k] * line[k]
        total += taps[v - y + far] * along
    return total


@kernel
def _move_edges(photo, fitted, missing, taps, weight, least_edge, first, last, settled):
    """Rows [first, last): pixels take over the height of a neighbour across an edge where that fits better.

    Coordinate descent; `missing` is kept up to date. weight: of outline and colours. settled (H, W): not looked at
    until something moves near it.
    """
    height, width = fitted.shape
    far, energy, sums = len(taps) // 2, (taps * taps).sum() ** 2, np.empty((2, 4))
    for y in range(first, last):
        for x in range(width):
            if settled[y, x]:
                continue
            settled[y, x] = True
            here = value = fitted[y, x]
            best, wanted = 0.0, np.nan
            for side in range(4):
                v, u = y + (side == 0) - (side == 1), x + (side == 2) - (side == 3)
                if not (0 <= v < height and 0 <= u < width) or same_surface(fitted[v, u], here, least_edge):
                    continue
                if wanted != wanted:
                    wanted = _correlate(missing, y, x, taps, far)
                there = fitted[v, u]
                # Change of the misfit |missing|^2, relative to that of a whole pixel; then of the outline and colours.
                change = 1.0 - 2.0 * wanted / ((there - here) * energy)
                change += weight * _same_surface_neighbours(fitted, y, x, here, there)
                if change - weight * COLOR_WEIGHT < best:
                    vote = _color_vote(photo, fitted, y, x, here, there, least_edge, sums)
                    change -= weight * COLOR_WEIGHT * vote
                    if change < best:
                        best, value = change, there
            if value != here:
                fitted[y, x] = value
                top, left = max(y - REVISIT_RADIUS_PX, 0), max(x - REVISIT_RADIUS_PX, 0)
                settled[top : y + REVISIT_RADIUS_PX + 1, left : x + REVISIT_RADIUS_PX + 1] = False
                left, right = max(x - far, 0), min(x + far, width - 1) + 1
                for v in range(max(y - far, 0), min(y + far, height - 1) + 1):
                    _add((here - value) * taps[v - y + far], taps[left - x + far :], missing[v, left:right])
