"""Edges of a sharpened map, moved so that the map, blurred again, gives the one that it was made of.

Ramps cut at half their height leave corners round and outlines ragged; the difference of both maps shows where.
"""

from __future__ import annotations

from math import ceil

import numpy as np

from iibr_core.depth.edges.line import GAUSSIAN_SIGMAS
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import same_surface
from iibr_core.types import FloatImage, image_size

SWEEPS = 4
"""Number of sweeps over the map in which edges move."""
COLOR_WEIGHT = 6.0
"""Weight of a colour that clearly belongs to one side; a neighbour on the other side weighs 1, as does the misfit of a
pixel on the wrong side.
"""
COLOR_PX = 3
"""Distance in which the colours of both sides are taken, in pixels."""
COLOR_NOISE = 0.003
"""Squared distance of colours (sRGB-encoded) that is noise."""


def fit_to_blur(photo: FloatImage, values: FloatImage, sharp: FloatImage, sigma: float, min_edge: float) -> FloatImage:
    """Return the sharp map with its edges moved so that its blur by sigma (px) gives `values`, all (H, W).

    photo: (H, W, 3), sRGB-encoded. Edges move where the sharp map differs from `values`, and onwards from there.
    min_edge: least step that moves.
    """
    reach = ceil(GAUSSIAN_SIGMAS * sigma)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    taps = (taps / taps.sum()).astype(np.float32)
    fitted, missing, settled = sharp.copy(), np.empty_like(sharp), sharp == values
    in_bands(lambda first, last: _find_missing(values, fitted, taps, first, last, missing), image_size(values))
    for _ in range(SWEEPS):
        # Bands are processed one after the other: each move changes `missing` for the next one.
        in_bands(
            lambda first, last: _move_edges(photo, fitted, missing, taps, min_edge, (first, last), settled),
            image_size(values),
            threads=1,
        )
    return fitted


@kernel
def _find_missing(values, fitted, taps, first, last, missing):
    """Write rows [first, last) of the given map minus the blurred one. The border's pixels continue outside."""
    height, width = values.shape
    far = len(taps) // 2
    line = np.empty(width + 2 * far, np.float32)
    for y in range(first, last):
        line[:] = 0.0
        for j in range(-far, far + 1):
            line[far : far + width] += taps[far + j] * fitted[min(max(y + j, 0), height - 1)]
        line[:far], line[far + width :] = line[far], line[far + width - 1]
        missing[y] = values[y]
        for i in range(2 * far + 1):
            missing[y] -= taps[i] * line[i : i + width]


@kernel
def _color_vote(photo, fitted, y, x, here, there, min_edge, sums):
    """Return the side of a pixel by matting between the colours of both surfaces around it, -1 (here) to 1 (there)."""
    height, width = fitted.shape
    near = max(0.3 * abs(there - here), min_edge)
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
                sums[side, 3] += 1.0 / apart
                for c in range(3):
                    sums[side, c] += photo[v, u, c] / apart
    if min(sums[0, 3], sums[1, 3]) == 0:
        return 0.0
    along = contrast = away = 0.0
    for c in range(3):
        origin = sums[0, c] / sums[0, 3]
        step, offset = sums[1, c] / sums[1, 3] - origin, photo[y, x, c] - origin
        along, contrast, away = along + offset * step, contrast + step**2, away + offset**2
    share = along / max(contrast, 1e-9)
    residual = max(away - share * along, 0.0)
    return 2.0 * (min(max(share, 0.0), 1.0) - 0.5) * contrast / (contrast + residual + COLOR_NOISE)


@kernel
def _outline_change(fitted, y, x, here, there):
    """Return how many more of the eight neighbours are on the surface `here` than on `there`."""
    height, width = fitted.shape
    more, near = -1, 0.5 * abs(there - here)
    for j in range(-1, 2):
        for i in range(-1, 2):
            value = fitted[min(max(y + j, 0), height - 1), min(max(x + i, 0), width - 1)]
            more += same_surface(value, here, near) - same_surface(value, there, near)
    return more


@kernel
def _move_edges(photo, fitted, missing, taps, min_edge, rows, settled):
    """Give pixels of rows [rows[0], rows[1]) the height of a neighbour across an edge where that fits better.

    Coordinate descent; `missing` is kept up to date. settled (H, W): pixels that are skipped until one near them moves.
    """
    height, width = fitted.shape
    far, energy, sums = len(taps) // 2, (taps * taps).sum() ** 2, np.empty((2, 4))
    for y in range(rows[0], rows[1]):
        for x in range(width):
            if settled[y, x]:
                continue
            settled[y, x] = True
            here = value = fitted[y, x]
            best, wanted = 0.0, np.nan
            top, bottom, left, right = (
                max(y - far, 0),
                min(y + far + 1, height),
                max(x - far, 0),
                min(x + far + 1, width),
            )
            row = taps[left - x + far : right - x + far]
            for side in range(4):
                v, u = y + (side == 0) - (side == 1), x + (side == 2) - (side == 3)
                if not (0 <= v < height and 0 <= u < width) or same_surface(fitted[v, u], here, min_edge):
                    continue
                if wanted != wanted:
                    wanted = 0.0
                    for line in range(top, bottom):
                        wanted += taps[line - y + far] * (row * missing[line, left:right]).sum()
                there = fitted[v, u]
                # Change of the misfit |missing|^2, relative to that of a whole pixel; then of the outline and colours.
                change = 1.0 - 2.0 * wanted / ((there - here) * energy) + _outline_change(fitted, y, x, here, there)
                if change - COLOR_WEIGHT < best:
                    change -= COLOR_WEIGHT * _color_vote(photo, fitted, y, x, here, there, min_edge, sums)
                    if change < best:
                        best, value = change, there
            if value != here:
                fitted[y, x] = value
                settled[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3] = False
                for line in range(top, bottom):
                    missing[line, left:right] += (here - value) * taps[line - y + far] * row
