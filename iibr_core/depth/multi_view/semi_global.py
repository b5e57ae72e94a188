"""One disparity for each pixel from the costs of many: semi-global matching (Hirschmüller, PAMI 2008)."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage

STEP_COST = 8
"""Cost of one step of disparity between neighbouring pixels, where costs of matching end at 255."""
JUMP_COST = 240
"""Cost of a larger step, where the picture has no edge."""
EDGE_LUMA = 0.02
"""Edge of the picture (1 = white) at which a jump costs a third."""


def choose_disparity(
    costs: NDArray[np.uint8], luma: FloatImage, disparities: NDArray[np.float32]
) -> tuple[FloatImage, FloatImage]:
    """Return the disparity (H, W) that suits each pixel and its neighbours, and its sureness (H, W), 0 .. 1.

    costs: (H, W, D), 0 .. 255, of D >= 1 evenly spaced disparities. luma: (H, W) of the picture, 0 .. 1. The result
    lies between two disparities, at the lowest point of a parabola. A pixel is sure if its disparity costs far less
    than the mean of all.
    """
    directions = [at for at in product((-1, 0, 1), repeat=2) if any(at)]
    halves = np.zeros((2, *costs.shape), np.uint16)

    def sum_paths(half: int) -> None:
        for down, across in directions[half::2]:
            raise_if_stopped()
            _add_path(costs, luma, down, across, halves[half])

    in_pieces(sum_paths, range(2), tiling.THREADS)
    values, sureness = np.empty(luma.shape, np.float32), np.empty(luma.shape, np.float32)
    _choose(halves, costs, disparities, values, sureness)
    return values, sureness


@kernel
def _add_path(costs, luma, down, across, sums):
    """Add the costs of the cheapest path that comes from one direction (equation 13 of the paper)."""
    height, width, count = costs.shape
    # Line by line: columns if the path runs along a row, else rows.
    is_along_row = down == 0
    lines, places = (width, height) if is_along_row else (height, width)
    is_forward = across > 0 if is_along_row else down > 0
    previous, current = np.zeros((places, count), np.float32), np.zeros((places, count), np.float32)
    previous_min, current_min = np.zeros(places, np.float32), np.zeros(places, np.float32)
    for step in range(lines):
        line = step if is_forward else lines - 1 - step
        for place in range(places):
            y, x = (place, line) if is_along_row else (line, place)
            from_y, from_x = y - down, x - across
            has_previous = from_y >= 0 and from_y < height and from_x >= 0 and from_x < width
            if has_previous:
                source = from_y if is_along_row else from_x
                edge = abs(luma[y, x] - luma[from_y, from_x])
                jump = max(np.float32(STEP_COST), np.float32(JUMP_COST) * np.exp(-edge / np.float32(EDGE_LUMA)))
                lowest = previous_min[source]
            least = np.float32(np.inf)
            for index in range(count):
                cost = np.float32(costs[y, x, index])
                if has_previous:
                    best = min(previous[source, index], lowest + jump)
                    if index > 0:
                        best = min(best, previous[source, index - 1] + STEP_COST)
                    if index < count - 1:
                        best = min(best, previous[source, index + 1] + STEP_COST)
                    cost += best - lowest
                current[place, index] = cost
                least = min(least, cost)
                sums[y, x, index] += np.uint16(cost + np.float32(0.5))
            current_min[place] = least
        previous, current = current, previous
        previous_min, current_min = current_min, previous_min


@kernel
def _choose(sums, costs, disparities, values, sureness):
    """Take the disparity with the lowest sum of both halves, moved to the lowest point of the parabola there."""
    height, width, count = costs.shape
    totals = np.empty(count, np.float32)
    for y in range(height):
        for x in range(width):
            best, mean = 0, np.float32(0)
            for index in range(count):
                totals[index] = np.float32(sums[0, y, x, index]) + np.float32(sums[1, y, x, index])
                mean += costs[y, x, index]
                if totals[index] < totals[best]:
                    best = index
            mean /= count
            sureness[y, x] = max(mean - costs[y, x, best], np.float32(0)) / max(mean, np.float32(1))
            values[y, x] = disparities[best]
            if best > 0 and best < count - 1:
                below, above = totals[best - 1], totals[best + 1]
                bend = below - 2 * totals[best] + above
                if bend > 0:
                    values[y, x] += (disparities[1] - disparities[0]) * np.float32(0.5) * (below - above) / bend
