"""A sharpened map, blurred again, should give the map that it was made of: where it does not, its edges move.

Colours alone leave outlines ragged where both sides are textured: what the blurred map misses shows it. Where maps and
photo contradict each other, so that no outline satisfies both, or where the map was made soft in some other way than by
this blur, nothing changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.edge_blur import EdgeBlur
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.types import FloatImage, ImageSize, image_size

FITTED_SIGMAS = 3.0
"""Where a Gaussian ends."""
WIDEST_FITTED_SIGMA_PX = 4.5
"""Work grows with the blur's area: wider ones stay as they are."""
DESCENT_SWEEPS = 4
"""Of moving edges."""
REVISIT_RADIUS_PX = 2
"""Beside a pixel that moved, so far around, the next sweep looks again."""
COLOR_WEIGHT = 6.0
"""What a colour that is clearly one side's counts, in what a whole pixel on the wrong side adds to the misfit."""
OUTLINE_WEIGHT = 1.0
"""What each of the eight neighbours counts that is on the other side."""
COLOR_PX = 3
"""Colours of both sides are taken from so far around."""
COLOR_NOISE = 0.003
"""Squared distance of colours (sRGB-encoded) that tells nothing."""
SAME_SIDE = 0.3
"""Of the step, up to which a height is that side's."""
MOVED_EDGES = 2.0
"""Times the least edge: lower steps stay where they are."""
MOST_CELL_MISFIT = 0.09
"""Of the fitted map, blurred again, from the given map, relative to what the blur changed (rms of a cell)."""


def fit_to_blur(
    photo: FloatImage,
    values: FloatImage,
    sharp: FloatImage,
    blur: EdgeBlur,
    least_edge: float,
    should_stop: ShouldStop = never,
) -> FloatImage:
    """The map `sharp` (H, W) with its edges moved so that, blurred, it gives `values` (H, W).

    photo: (H, W, 3), sRGB-encoded; it counts, too, in where an edge lies. least_edge: the step that counts as one.
    Cells in which no such map is found keep their bits. Raises Cancelled once should_stop is true.
    """
    taps, reach = _taps(blur)
    if not reach.any():
        return sharp
    cells, width = (taps, reach, blur.cell_px), values.shape[1]
    fitted, missing, visited = sharp.copy(), np.zeros_like(sharp), np.zeros(sharp.shape, np.bool_)

    def find_missing(first: int, last: int) -> None:
        _find_missing(values, fitted, *cells, first, last, missing)

    def move(first: int, last: int) -> None:
        _move_edges(photo, fitted, missing, *cells, MOVED_EDGES * least_edge, first, last, visited)

    in_bands(find_missing, ImageSize(len(reach), blur.cell_px * width), should_stop)
    for _ in range(DESCENT_SWEEPS):
        # One band after the other: each move sees what those before it left missing.
        in_bands(move, image_size(values), should_stop, threads=1)
    changed, misfit = _cell_squares(values - fitted, blur), _cell_squares(missing, blur)
    found = np.isfinite(misfit) & (misfit <= MOST_CELL_MISFIT**2 * changed)
    return np.where(blur.at_pixels(found, image_size(values)), fitted, sharp)


def _taps(blur: EdgeBlur) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Of each cell (M, N): a Gaussian (M, N, R) that sums to 1, and how far it reaches to both sides, 0 = none."""
    fits = blur.sigma_px <= WIDEST_FITTED_SIGMA_PX
    reach = np.where(fits, np.ceil(FITTED_SIGMAS * blur.sigma_px), 0).astype(np.int64)
    apart = np.abs(np.arange(2 * int(reach.max()) + 1) - reach[..., None])
    sigma = np.maximum(blur.sigma_px, 1e-3)[..., None]
    taps = np.where(apart <= reach[..., None], np.exp(-0.5 * (apart / sigma) ** 2), 0.0)
    return (taps / taps.sum(axis=2, keepdims=True)).astype(np.float32), reach


def _cell_squares(values: FloatImage, blur: EdgeBlur) -> NDArray[np.float64]:
    """(M, N): sum of squares of the pixels (H, W) of each cell."""
    rows, columns = (np.arange(0, length, blur.cell_px) for length in values.shape)
    squares = np.square(values, dtype=np.float64)
    return np.asarray(np.add.reduceat(np.add.reduceat(squares, rows, 0), columns, 1))


@kernel
def _find_missing(values, fitted, taps, reach, cell, first, last, missing):
    """Rows [first, last) of cells: the given map less the fitted one, blurred."""
    height, width = values.shape
    for row in range(first, last):
        for column in range(reach.shape[1]):
            far, own = reach[row, column], taps[row, column]
            if far == 0:
                continue
            top, left = row * cell, column * cell
            bottom, right = min(top + cell, height), min(left + cell, width)
            # Separable: rows of the cell and of what its blur reaches, then columns. The border's pixels go on.
            line = np.empty(right - left + 2 * far, np.float32)
            blurred = np.zeros((bottom - top + 2 * far, right - left), np.float32)
            for y in range(len(blurred)):
                v = min(max(top + y - far, 0), height - 1)
                for x in range(len(line)):
                    line[x] = fitted[v, min(max(left + x - far, 0), width - 1)]
                for i in range(-far, far + 1):
                    _add(own[far + i], line[far + i :], blurred[y])
            for y in range(top, bottom):
                total = -values[y, left:right]
                for j in range(-far, far + 1):
                    _add(own[far + j], blurred[y - top + far + j], total)
                missing[y, left:right] = -total


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
            more += (1 if abs(value - here) < near else 0) - (1 if abs(value - there) < near else 0)
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
def _move_edges(photo, fitted, missing, taps, reach, cell, least_edge, first, last, visited):
    """Rows [first, last): pixels take over the height of a neighbour across an edge where that fits better.

    Coordinate descent; `missing` is kept up to date. visited (H, W): what was looked at, until something moves near it.
    """
    height, width = fitted.shape
    sums = np.empty((2, 4))
    for y in range(first, last):
        for x in range(width):
            here = fitted[y, x]
            # Most pixels end here.
            if visited[y, x] or not (
                abs(fitted[max(y - 1, 0), x] - here) >= least_edge
                or abs(fitted[min(y + 1, height - 1), x] - here) >= least_edge
                or abs(fitted[y, max(x - 1, 0)] - here) >= least_edge
                or abs(fitted[y, min(x + 1, width - 1)] - here) >= least_edge
            ):
                continue
            row, column, visited[y, x] = y // cell, x // cell, True
            far, own = reach[row, column], taps[row, column]
            if far == 0:
                continue
            wanted, energy = _correlate(missing, y, x, own, far), (own * own).sum() ** 2
            best, value = 0.0, here
            for side in range(4):
                v, u = y + (side == 0) - (side == 1), x + (side == 2) - (side == 3)
                if not (0 <= v < height and 0 <= u < width) or abs(fitted[v, u] - here) < least_edge:
                    continue
                there = fitted[v, u]
                # Change of the misfit |missing|^2, relative to that of a whole pixel; then of the outline and colours.
                change = 1.0 - 2.0 * wanted / ((there - here) * energy)
                change += OUTLINE_WEIGHT * _same_surface_neighbours(fitted, y, x, here, there)
                if change - COLOR_WEIGHT < best:
                    change -= COLOR_WEIGHT * _color_vote(photo, fitted, y, x, here, there, least_edge, sums)
                    if change < best:
                        best, value = change, there
            if value != here:
                fitted[y, x] = value
                top, left = max(y - REVISIT_RADIUS_PX, 0), max(x - REVISIT_RADIUS_PX, 0)
                visited[top : y + REVISIT_RADIUS_PX + 1, left : x + REVISIT_RADIUS_PX + 1] = False
                left, right = max(x - far, 0), min(x + far, width - 1) + 1
                for v in range(max(y - far, 0), min(y + far, height - 1) + 1):
                    _add((here - value) * own[v - y + far], own[left - x + far :], missing[v, left:right])
