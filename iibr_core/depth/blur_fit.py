"""A sharpened map, blurred again, should give the map that it was made of: where it does not, its edges move.

Colours alone leave outlines ragged where both sides are textured, and what lies beside an edge keeps some of the other
side's height (a halo). Both show in what the blurred map misses. Where maps and photo contradict each other, so that
no outline satisfies both, or where the map was made soft in some other way than by this blur, nothing changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edge_blur import EdgeBlur
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.types import FloatImage, ImageSize, image_size

REACH_SIGMAS = 3.0
"""Where a Gaussian ends."""
WIDEST_SIGMA_PX = 4.5
"""Work grows with the blur's area: wider ones stay as they are."""
ROUNDS = 2
SWEEPS = 2
"""Of moving edges, in each round."""
STIRRED_PX = 2
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
CLEAN = np.float32(0.85)
"""A pixel of whose blur a smaller share comes from its own surface tells nothing of that surface's height."""
MOSTLY_CLEAN = np.float32(0.95)
"""From this share on, a pixel's own height counts, too."""
SLOPE_DAMPING = 0.1
"""Squared sigmas, added to the spread of clean pixels."""
SURFACE_EDGES = 6.0
"""Times the least edge: heights within it may be one surface's."""
MOVED_EDGES = 2.0
"""Times the least edge: lower steps stay where they are."""
LATTICES = ((1, 0), (2, 1), (5, 2), (8, 3), (10, 3))
"""Of pixels that stand for all of them: every n-th of a row, shifted by so many from row to row."""
LATTICE_SIGMAS = 0.8
"""Their spacing, the root of n, is at most that: then a Gaussian has the same means over them."""
MOST_MISFIT = 0.1
"""Of the fitted map, blurred again, from the given map, relative to what the blur changed (rms of a cell)."""


def fit_to_blur(
    photo: FloatImage,
    values: FloatImage,
    sharp: FloatImage,
    blur: EdgeBlur,
    least_edge: float,
    should_stop: ShouldStop = never,
) -> FloatImage:
    """The map `sharp` (H, W) with its edges moved and halos lowered so that, blurred, it gives `values` (H, W).

    photo: (H, W, 3), sRGB-encoded; it counts, too, in where an edge lies. least_edge: the step that counts as one.
    Cells in which no such map is found keep their bits. Raises Cancelled once should_stop is true.
    """
    taps, reach = _taps(blur)
    if not reach.any():
        return sharp
    cells, lattices = (taps, reach, blur.cell_px), (*_lattices(blur, reach), blur.cell_px)
    surface, margin = np.float32(SURFACE_EDGES * least_edge), int(reach.max())
    size, cell_rows = image_size(values), ImageSize(len(reach), blur.cell_px * values.shape[1])
    fitted = sharp.copy()
    near, clean, missing = np.zeros(sharp.shape, np.bool_), np.ones_like(sharp), np.zeros_like(sharp)

    def mark(first: int, last: int) -> None:
        _mark_near_edges(sharp, reach, blur.cell_px, surface, first, last, near)

    def find_missing(first: int, last: int) -> None:
        _find_missing(values, fitted, *cells, first, last, missing)

    def find_clean(first: int, last: int) -> None:
        _find_clean(wide, near, *lattices, surface, first, last, clean)

    def lower(first: int, last: int) -> None:
        _lower_halos(wide, wide_missing, wide_clean, near, *lattices, blur.sigma_px, surface, first, last, fitted)

    def move(first: int, last: int) -> None:
        _move_edges(photo, fitted, missing, *cells, MOVED_EDGES * least_edge, first, last, settled)

    in_bands(mark, size, should_stop)
    near &= _at_pixels(reach > 0, blur, size)
    in_bands(find_missing, cell_rows, should_stop)
    for _ in range(ROUNDS):
        wide = np.pad(fitted, margin, mode="edge")
        in_bands(find_clean, size, should_stop)
        # What lies outside tells nothing.
        wide_missing, wide_clean = np.pad(missing, margin), np.pad(clean, margin)
        in_bands(lower, size, should_stop)
        in_bands(find_missing, cell_rows, should_stop)
        settled = np.zeros_like(near)
        for _ in range(SWEEPS):
            # One band after the other: each move sees what those before it left missing.
            in_bands(move, size, should_stop, threads=1)
    changed, misfit = _cell_squares(values - fitted, blur), _cell_squares(missing, blur)
    found = np.isfinite(misfit) & (misfit <= MOST_MISFIT**2 * changed)
    return np.where(_at_pixels(found, blur, size), fitted, sharp)


def _taps(blur: EdgeBlur) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Of each cell (M, N): a Gaussian (M, N, R) that sums to 1, and how far it reaches to both sides, 0 = none."""
    fits = blur.sigma_px <= WIDEST_SIGMA_PX
    reach = np.where(fits, np.ceil(REACH_SIGMAS * blur.sigma_px), 0).astype(np.int64)
    apart = np.abs(np.arange(2 * int(reach.max()) + 1) - reach[..., None])
    sigma = np.maximum(blur.sigma_px, 1e-3)[..., None]
    taps = np.where(apart <= reach[..., None], np.exp(-0.5 * (apart / sigma) ** 2), 0.0)
    return (taps / taps.sum(axis=2, keepdims=True)).astype(np.float32), reach


def _lattices(blur: EdgeBlur, reach: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Of each cell (M, N): pixels (M, N, K, 2) that stand for those its blur reaches; weights (M, N, K), sums are 1.

    Pixels, down and across, are counted from the corner of what the widest blur reaches.
    """
    down, across = np.mgrid[-reach.max() : reach.max() + 1, -reach.max() : reach.max() + 1]
    apart = down**2 + across**2
    points, weights = [], []
    for sigma in np.where(reach > 0, blur.sigma_px, 0).flat:
        nth, shift = [lattice for lattice in LATTICES if lattice[0] <= max((LATTICE_SIGMAS * sigma) ** 2, 1)][-1]
        is_on = (apart <= (REACH_SIGMAS * sigma) ** 2) & ((across - shift * down) % nth == 0)
        weight = np.exp(-0.5 * apart[is_on] / max(sigma, 1e-3) ** 2)
        points.append(np.argwhere(is_on))
        weights.append(weight / weight.sum())
    most = max(map(len, points))
    # Those of narrow blurs are followed by pixels of no weight.
    pixels = np.array([np.pad(at, ((0, most - len(at)), (0, 0))) for at in points])
    shares = np.array([np.pad(weight, (0, most - len(weight))) for weight in weights], np.float32)
    return pixels.reshape(*reach.shape, most, 2), shares.reshape(*reach.shape, most)


def _at_pixels(cells: NDArray[np.bool_], blur: EdgeBlur, size: ImageSize) -> NDArray[np.bool_]:
    """(H, W), what is true of a pixel's cell, from (M, N)."""
    return cells.repeat(blur.cell_px, 0).repeat(blur.cell_px, 1)[: size.height, : size.width]


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
def _mark_near_edges(sharp, reach, cell, step, first, last, near):
    """Mark what the blur of edges between these rows and those below them reaches."""
    height, width = sharp.shape
    for y in range(first, last):
        for x in range(width):
            far = reach[y // cell, x // cell]
            right, below = sharp[y, min(x + 1, width - 1)], sharp[min(y + 1, height - 1), x]
            if far > 0 and max(abs(right - sharp[y, x]), abs(below - sharp[y, x])) >= step:
                near[max(y - far, 0) : y + far + 2, max(x - far, 0) : x + far + 2] = True


@kernel
def _find_clean(wide, near, pixels, weights, cell, surface, first, last, clean):
    """Rows [first, last): how much of a pixel's blur comes from heights within `surface` of its own, 0..1.

    wide: the fitted map with a margin as wide as any blur reaches, of its border's pixels.
    """
    margin = (wide.shape[0] - near.shape[0]) // 2
    for y in range(first, last):
        for x in range(near.shape[1]):
            if not near[y, x]:
                continue
            row, column, here, total = y // cell, x // cell, wide[y + margin, x + margin], np.float32(0.0)
            for k in range(weights.shape[2]):
                value = wide[y + pixels[row, column, k, 0], x + pixels[row, column, k, 1]]
                total += weights[row, column, k] if abs(value - here) < surface else np.float32(0.0)
            clean[y, x] = total


@kernel
def _lower_halos(wide, missing, clean, near, pixels, weights, cell, sigmas, surface, first, last, lowered):
    """Rows [first, last): what the blur left of the other side's height beside an edge is taken off.

    Clean pixels of the same surface tell it; under the edge itself, their plane goes on. Nothing is added: round
    things bend away from the view at their outlines, as if something were missing there. wide, missing, clean: with
    a margin, which is not clean.
    """
    margin = (wide.shape[0] - near.shape[0]) // 2
    for y in range(first, last):
        for x in range(near.shape[1]):
            if not near[y, x]:
                continue
            row, column, here = y // cell, x // cell, wide[y + margin, x + margin]
            # Where the pixel itself is clean, only what is missing there is levelled out, and its own detail stays.
            is_clean = clean[y + margin, x + margin] > MOSTLY_CLEAN
            # Least squares for level + across * i + down * j.
            n = i1 = j1 = ii = jj = ij = p0 = pi = pj = np.float32(0.0)
            for k in range(weights.shape[2]):
                v, u = y + pixels[row, column, k, 0], x + pixels[row, column, k, 1]
                if clean[v, u] > CLEAN and abs(wide[v, u] - here) < surface:
                    i, j = np.float32(u - x - margin), np.float32(v - y - margin)
                    weight = weights[row, column, k] * (clean[v, u] - CLEAN)
                    value = missing[v, u] + (np.float32(0.0) if is_clean else wide[v, u] - here)
                    n, i1, j1, p0 = n + weight, i1 + weight * i, j1 + weight * j, p0 + weight * value
                    ii, jj, ij = ii + weight * i * i, jj + weight * j * j, ij + weight * i * j
                    pi, pj = pi + weight * i * value, pj + weight * j * value
            if not n > 0:
                continue
            i1, j1, p0 = i1 / n, j1 / n, p0 / n
            # Few pixels on a line tell no slope across it.
            damping = SLOPE_DAMPING * sigmas[row, column] ** 2
            ii, jj, ij = ii / n - i1 * i1 + damping, jj / n - j1 * j1 + damping, ij / n - i1 * j1
            pi, pj = pi / n - i1 * p0, pj / n - j1 * p0
            area = ii * jj - ij * ij
            level = p0 - i1 * (pi * jj - pj * ij) / area - j1 * (pj * ii - pi * ij) / area
            lowered[y, x] = here + min(level, 0.0)


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
def _fellows(fitted, y, x, here, there):
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
def _move_edges(photo, fitted, missing, taps, reach, cell, least_edge, first, last, settled):
    """Rows [first, last): pixels take over the height of a neighbour across an edge where that fits better.

    Coordinate descent; `missing` is kept up to date. settled (H, W): what was looked at, until something moves near it.
    """
    height, width = fitted.shape
    sums = np.empty((2, 4))
    for y in range(first, last):
        for x in range(width):
            here = fitted[y, x]
            # Most pixels end here.
            if settled[y, x] or not (
                abs(fitted[max(y - 1, 0), x] - here) >= least_edge
                or abs(fitted[min(y + 1, height - 1), x] - here) >= least_edge
                or abs(fitted[y, max(x - 1, 0)] - here) >= least_edge
                or abs(fitted[y, min(x + 1, width - 1)] - here) >= least_edge
            ):
                continue
            row, column, settled[y, x] = y // cell, x // cell, True
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
                change += OUTLINE_WEIGHT * _fellows(fitted, y, x, here, there)
                if change - COLOR_WEIGHT < best:
                    change -= COLOR_WEIGHT * _color_vote(photo, fitted, y, x, here, there, least_edge, sums)
                    if change < best:
                        best, value = change, there
            if value != here:
                fitted[y, x] = value
                top, left = max(y - STIRRED_PX, 0), max(x - STIRRED_PX, 0)
                settled[top : y + STIRRED_PX + 1, left : x + STIRRED_PX + 1] = False
                left, right = max(x - far, 0), min(x + far, width - 1) + 1
                for v in range(max(y - far, 0), min(y + far, height - 1) + 1):
                    _add((here - value) * own[v - y + far], own[left - x + far :], missing[v, left:right])
