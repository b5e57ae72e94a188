"""Candidates A_j of the paper (section 3.2): which source rays land near each target ray.

A source ray at (x, y) with disparity d lands at (x - d*s, y - d*t). Its footprint, one pixel wide where the disparity
is constant, stretches to meet its neighbours on the same surface. Rays of one source and one surface that land on the
same pixel look up the same colour, so they are kept as one candidate: K candidates are K surfaces, and K = 5 is plenty.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.rays import CELL_PX, RaySet
from iibr_core.method.smooth_cells import backward_warp, cells_in, find_smooth_cells, land_rough
from iibr_core.method.steep_surfaces import BELOW, RIGHT, slope_at
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.surfaces import SAME_SURFACE_PX, same_surface
from iibr_core.types import FloatImage, ViewOffset

SLOTS = 5
"""Largest number K of candidates of a ray."""
SEALED_GAP_PX = 0.75
"""Largest gap between landing neighbours that is no disocclusion, in pixels: their footprints stretch to meet."""
CLOSED_GAP_PX = 1.25
"""Largest gap that the farther of two rays closes alone, in pixels: its surface continues behind the nearer one."""
MAX_STRETCHED_PX = 8.0
"""Gap above which even a steep surface is torn: so few of its rays say little about it."""
MIN_SHRUNK = 0.05
"""Share of its width below which a compressed surface turns its back to the view."""
COVERED = 0.999
"""Share of a pixel from which on a surface hides what lies behind it."""


class Candidates(NamedTuple):
    """The candidates of the target rays in rows [first_row, first_row + N) of one view.

    number (N, W): how many of the K slots are used. coverage (K, N, W): area of the target pixel that their footprints
    cover, which may exceed 1. disparity (K, N, W): mean, weighted by coverage. source (K, N, W): index into the ray
    set. Slots beyond number are undefined. smooth: cells that one smooth surface fills, see `find_smooth_cells`.
    """

    offset: ViewOffset
    first_row: int
    number: NDArray[np.uint8]
    coverage: FloatImage
    disparity: FloatImage
    source: NDArray[np.uint8]
    smooth: NDArray[np.bool_]


def find_candidates(
    rays: RaySet, offset: ViewOffset, rows: tuple[int, int], columns: tuple[int, int] | None = None
) -> Candidates:
    """Return the candidates of the target rays in rows [first, last) of the view at `offset`, the nearest surfaces.

    columns: [first, last) of the rays that are looked at, all by default.
    """
    first_row, last_row = rows
    columns = columns or (0, rays.size.width)
    offset = ViewOffset(*map(float, offset))  # kernels are compiled for one kind of offset
    # In cells with one smooth surface, rays are traced back; in all others, source rays are splatted.
    smooth, about = find_smooth_cells(rays, offset, rows, columns)
    splat = cells_in(columns, smooth.shape) & ~smooth
    shape = (SLOTS, last_row - first_row, rays.size.width)
    found = Candidates(
        offset,
        first_row,
        np.zeros(shape[1:], np.uint8),
        np.empty(shape, np.float32),
        np.empty(shape, np.float32),
        np.empty(shape, np.uint8),
        smooth,
    )
    arrays, no_steep = rays.arrays, np.zeros_like(rays.steep)
    for k, (t, s) in enumerate(rays.to_view(offset)):
        needed = np.zeros_like(no_steep)
        land_rough(arrays, k, (t, s), first_row // CELL_PX, splat, needed)
        # Only the photo has steep surfaces.
        steepness = rays.joined, no_steep if k else rays.steep
        _land_rays(arrays, k, steepness, np.flatnonzero(needed), columns, (t, s), found)
    _mean_disparity(found, splat)
    backward_warp(arrays.disparity[0], offset, about, found)
    return found


@kernel
def _half_extent(nearer, shift, is_joined):
    """Return how far a footprint reaches towards a neighbour that is nearer by this disparity, which moves it away by
    shift times that, in pixels. is_joined: whether both lie on one steep surface.
    """
    gap = nearer * shift
    # Wider gaps are disocclusions and stay open; neighbours that land on each other are two surfaces.
    if abs(gap) <= SEALED_GAP_PX or (is_joined and MIN_SHRUNK - 1.0 <= gap <= MAX_STRETCHED_PX):
        return 0.5 + 0.5 * gap
    return 0.5 + gap if nearer > 0 and 0 < gap <= CLOSED_GAP_PX else 0.5


@kernel
def _rearmost(coverage, disparity, row, column):
    """Return the slot with the smallest mean disparity, of sums weighted by coverage; all slots are used."""
    slot = 0
    for k in range(1, len(coverage)):
        # Compared crosswise to save the divisions.
        ahead = disparity[slot, row, column] * coverage[k, row, column]
        if disparity[k, row, column] * coverage[slot, row, column] < ahead:
            slot = k
    return slot


@kernel
def _land_rays(rays, index, steepness, needed, columns, to_view, found):
    """Let the rays in the needed cells (N) of one source land. Smooth cells are overwritten by `backward_warp`.

    The overlap of a footprint and a pixel, as an area, is added to the candidate of its surface or starts one; if all
    slots are used, the rearmost one gives way. Until `_mean_disparity`, found's disparity holds sums weighted by
    coverage. steepness: rays that steep surfaces join, and cells that hold such rays. All in one loop: a function for
    each overlap takes twice the time.
    """
    (joined, steep), (t, s) = steepness, to_view
    ray_disparity, ray_coverage, first_row = rays.disparity[index], rays.coverage[index], found.first_row
    count, coverage, disparity, source = found.number, found.coverage, found.disparity, found.source
    slots, rows, width = coverage.shape
    height = len(ray_disparity)
    one_surface = SAME_SURFACE_PX / max(abs(s), abs(t), 1e-9)
    for i in range(len(needed)):
        cell_row, cell = divmod(needed[i], steep.shape[1])
        is_steep = steep[cell_row, cell]
        for y in range(cell_row * CELL_PX, min((cell_row + 1) * CELL_PX, height)):
            for x in range(cell * CELL_PX, min((cell + 1) * CELL_PX, width)):
                filled = ray_coverage[y, x]
                if not filled > 0:
                    continue
                # Forward warp: where the ray lands, and the footprint there that meets its neighbours' half-way.
                d = ray_disparity[y, x]
                landed_x, landed_y = x - d * s, y - d * t
                before, after = max(x - 1, 0), min(x + 1, width - 1)
                above, below = max(y - 1, 0), min(y + 1, height - 1)
                bits_before = bits_above = bits = 0
                tolerance, slope_x, slope_y = one_surface, 0.0, 0.0
                if is_steep:
                    rise_x = slope_at(ray_disparity, joined, RIGHT, y, x)
                    rise_y = slope_at(ray_disparity, joined, BELOW, y, x)
                    # How much the view stretches the surface, as an area: its slope is spread over more pixels.
                    stretched = 1.0 - s * rise_x - t * rise_y
                    if (rise_x != 0.0 or rise_y != 0.0) and stretched >= MIN_SHRUNK:
                        bits_before, bits_above, bits = joined[y, before], joined[above, x], joined[y, x]
                        slope_x, slope_y = rise_x / stretched, rise_y / stretched
                        tolerance = max(one_surface, abs(slope_x) + abs(slope_y))
                left = landed_x - _half_extent(ray_disparity[y, before] - d, s, bits_before & RIGHT)
                right = landed_x + _half_extent(ray_disparity[y, after] - d, -s, bits & RIGHT)
                top = landed_y - _half_extent(ray_disparity[above, x] - d, t, bits_above & BELOW)
                bottom = landed_y + _half_extent(ray_disparity[below, x] - d, -t, bits & BELOW)
                # Beside the target rows, or not finite.
                if not (right > -0.5 and left < width and bottom > first_row - 0.5 and top < first_row + rows):
                    continue
                first_y, last_y = max(nearest_pixel(top), first_row), min(ceil(bottom - 0.5), first_row + rows - 1)
                for target_y in range(first_y, last_y + 1):
                    from_y, to_y = max(top, target_y - 0.5), min(bottom, target_y + 0.5)
                    overlap_y, across = filled * (to_y - from_y), 0.5 * (from_y + to_y) - landed_y
                    for target_x in range(max(nearest_pixel(left), columns[0]), min(ceil(right - 0.5) + 1, columns[1])):
                        from_x, to_x = max(left, target_x - 0.5), min(right, target_x + 0.5)
                        overlap = np.float32(overlap_y * (to_x - from_x))
                        if not overlap > 0.0:
                            continue
                        # On a steep surface, the disparity in the middle of the overlap.
                        d_here = np.float32(d + slope_y * across + slope_x * (0.5 * (from_x + to_x) - landed_x))
                        # Unsigned: never counted from the end.
                        row, column = np.uint64(target_y - first_row), np.uint64(target_x)
                        used = np.int64(count[row, column])
                        # The photo has landed: a surface that covers the pixel hides all surfaces behind it.
                        if index > 0 and used > 0:
                            covered = coverage[0, row, column]
                            if covered >= COVERED and disparity[0, row, column] > (d_here + tolerance) * covered:
                                continue
                        slot = 0
                        while slot < used:
                            # Disparity holds sums, so disparities are compared times coverage.
                            c = coverage[slot, row, column]
                            if source[slot, row, column] == index and same_surface(
                                disparity[slot, row, column], d_here * c, tolerance * c
                            ):
                                break
                            slot += 1
                        if slot < used:
                            coverage[slot, row, column] += overlap
                            disparity[slot, row, column] += overlap * d_here
                            continue
                        if used < slots:
                            count[row, column] = used + 1
                        else:
                            slot = _rearmost(coverage, disparity, row, column)
                            if disparity[slot, row, column] >= d_here * coverage[slot, row, column]:
                                continue
                        coverage[slot, row, column] = overlap
                        disparity[slot, row, column] = overlap * d_here
                        source[slot, row, column] = index


@kernel
def _mean_disparity(found, splat):
    """Turn the weighted sums of disparity into means."""
    count, coverage, disparity, above = found.number, found.coverage, found.disparity, found.first_row % CELL_PX
    rows, width = count.shape
    for row in range(rows):
        for cell in range(splat.shape[1]):
            if not splat[(row + above) // CELL_PX, cell]:
                continue
            for x in range(cell * CELL_PX, min((cell + 1) * CELL_PX, width)):
                for k in range(np.int64(count[row, x])):
                    disparity[k, row, x] /= coverage[k, row, x]
