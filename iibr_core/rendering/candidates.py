"""Which source rays land near each target ray.

A source ray at (x, y) with disparity d lands at (x - d*s, y - d*t). Its footprint, one pixel wide where the disparity
is constant, stretches to meet its neighbours on the same surface. Rays of one source and one surface that land on the
same pixel look up the same colour, so they are kept as one candidate: K candidates are K surfaces, and K = 5 is
plenty.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.coherent_cells import backward_warp, find_coherent_cells, land_incoherent
from iibr_core.rendering.ray_set import CELL_PX, RaySet
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.types import FloatImage, ViewOffset

SAME_SURFACE_PX = 0.5
"""Rays of one source whose colour look-ups lie closer than this are one candidate."""
SEALED_GAP_PX = 0.75
"""A gap between landing neighbours up to this wide is no disocclusion: their footprints stretch to meet."""
LEAST_OVERLAP = 1e-4


@dataclass(frozen=True, eq=False)
class Candidates:
    """The candidates of the target rays in rows [first_row, first_row + N) of one view.

    count: (N, W), how many of the K slots are used. coverage: (K, N, W), the area of the target pixel their
    footprints cover (may exceed 1). disparity: (K, N, W), coverage-weighted mean. source: (K, N, W), index into the
    ray set. Slots beyond count are undefined. smooth: cells that one smooth surface fills (`find_coherent_cells`).
    """

    offset: ViewOffset
    first_row: int
    count: NDArray[np.uint8]
    coverage: FloatImage
    disparity: FloatImage
    source: NDArray[np.uint8]
    smooth: NDArray[np.bool_]


def find_candidates(rays: RaySet, offset: ViewOffset, rows: tuple[int, int], most: int = 5) -> Candidates:
    """Candidates of the target rays in rows [first, last) of the view at `offset`.

    At most `most` for each ray, the front-most kept.
    """
    first_row, last_row = rows
    # Where one smooth surface shows, its rays are found backwards, cell by cell; elsewhere source rays are splatted.
    smooth, about = find_coherent_cells(rays, offset, rows)
    shape = (most, last_row - first_row, rays.size.width)
    found = Candidates(
        offset,
        first_row,
        np.zeros(shape[1:], np.uint8),
        np.empty(shape, np.float32),
        np.empty(shape, np.float32),
        np.empty(shape, np.uint8),
        smooth,
    )
    offsets, _, disparity, coverage, _ = rays.arrays
    cells = rays.cells
    for k in range(len(rays)):
        t, s = offset.t - offsets[k, 0], offset.s - offsets[k, 1]
        needed = land_incoherent(cells, k, t, s, rows, smooth)
        _land_rays(
            disparity[k], coverage[k], needed, needed.any(axis=1), k, s, t, first_row,
            found.count, found.coverage, found.disparity, found.source,
        )  # fmt: skip
    _mean_disparity(found.count, found.coverage, found.disparity)
    backward_warp(
        disparity[0], *offset, first_row, smooth, about,
        found.count, found.coverage, found.disparity, found.source,
    )  # fmt: skip
    return found


@kernel
def _half_extent(gap):
    """How far a footprint reaches towards a neighbour that lands 1 + gap pixels away."""
    # Wider gaps are disocclusions and stay open; neighbours that land on each other are two surfaces.
    return 0.5 + 0.5 * gap if abs(gap) <= SEALED_GAP_PX else 0.5


@kernel
def _rearmost(coverage, disparity, row, column):
    """The slot with the smallest mean disparity, of sums weighted by coverage; all slots are used."""
    slot = 0
    for k in range(1, len(coverage)):
        # Compared crosswise to save the divisions.
        ahead = disparity[slot, row, column] * coverage[k, row, column]
        if disparity[k, row, column] * coverage[slot, row, column] < ahead:
            slot = k
    return slot


@kernel
def _land_rays(
    ray_disparity, ray_coverage, needed, needed_rows, index, s, t, first_row, count, coverage, disparity, source
):  # fmt: skip
    """Let the rays in the needed cells of one source land on the target rows. Until `_mean_disparity`, `disparity`
    holds sums weighted by coverage.

    A footprint's overlap goes to the candidate of its surface, or starts one; where slots run out the rearmost gives
    way.
    """
    slots, rows, width = coverage.shape
    height = len(ray_disparity)
    # The same as a difference of disparities.
    tolerance = SAME_SURFACE_PX / max(abs(s), abs(t), 1e-9)
    for y in range(height):
        if not needed_rows[y // CELL_PX]:
            continue
        for cell in range(needed.shape[1]):
            if not needed[y // CELL_PX, cell]:
                continue
            for x in range(cell * CELL_PX, min((cell + 1) * CELL_PX, width)):
                # Forward warp: where the ray lands, and the footprint there that meets its neighbours' half-way.
                filled = ray_coverage[y, x]
                if not filled > 0:
                    continue
                d = ray_disparity[y, x]
                landed_x, landed_y = x - d * s, y - d * t
                left = landed_x - _half_extent((ray_disparity[y, max(x - 1, 0)] - d) * s)
                right = landed_x + _half_extent((d - ray_disparity[y, min(x + 1, width - 1)]) * s)
                top = landed_y - _half_extent((ray_disparity[max(y - 1, 0), x] - d) * t)
                bottom = landed_y + _half_extent((d - ray_disparity[min(y + 1, height - 1), x]) * t)
                # Beside the target rows, or not finite.
                if not (right > -0.5 and left < width and bottom > first_row - 0.5 and top < first_row + rows):
                    continue
                first_y, last_y = max(nearest_pixel(top), first_row), min(ceil(bottom - 0.5), first_row + rows - 1)
                # Splat: each target pixel under the footprint gets its overlap, in pixels of area.
                for target_y in range(first_y, last_y + 1):
                    overlap_y = filled * (min(bottom, target_y + 0.5) - max(top, target_y - 0.5))
                    for target_x in range(max(nearest_pixel(left), 0), min(ceil(right - 0.5) + 1, width)):
                        overlap = np.float32(overlap_y * (min(right, target_x + 0.5) - max(left, target_x - 0.5)))
                        if not overlap > LEAST_OVERLAP:
                            continue
                        # Its surface's candidate, if any; `disparity` holds sums, so compare times coverage.
                        row, column = np.uint64(target_y - first_row), np.uint64(target_x)  # never counted from the end
                        used = np.int64(count[row, column])
                        slot = 0
                        while slot < used:
                            c = coverage[slot, row, column]
                            if (
                                source[slot, row, column] == index
                                and abs(disparity[slot, row, column] - d * c) <= tolerance * c
                            ):
                                break
                            slot += 1
                        if slot < used:
                            coverage[slot, row, column] += overlap
                            disparity[slot, row, column] += overlap * d
                            continue
                        # A new candidate: in a free slot, or instead of the rearmost one if that lies farther back (a
                        # z-test).
                        if used < slots:
                            count[row, column] = used + 1
                        else:
                            slot = _rearmost(coverage, disparity, row, column)
                            if disparity[slot, row, column] >= d * coverage[slot, row, column]:
                                continue
                        coverage[slot, row, column] = overlap
                        disparity[slot, row, column] = overlap * d
                        source[slot, row, column] = index


@kernel
def _mean_disparity(count, coverage, disparity):
    """Turn the weighted sums of disparity into means."""
    rows, width = count.shape
    for row in range(rows):
        for x in range(width):
            for k in range(np.int64(count[row, x])):
                disparity[k, row, x] /= coverage[k, row, x]
