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
EDGE_COLOR = 0.02
"""Edge of a channel (1 = white) at which a jump costs a third."""
UNREACHED = 30_000
"""Cost above those of all paths."""


def choose_disparity(
    costs: NDArray[np.uint8], colors: FloatImage, disparities: NDArray[np.float32], is_striped: NDArray[np.bool_]
) -> tuple[FloatImage, FloatImage]:
    """Return the disparity (H, W) that suits each pixel and its neighbours, and its sureness (H, W), 0 .. 1.

    costs: (H, W, D), 0 .. 255, of D >= 1 evenly spaced disparities. colors: (H, W, 3), 0 .. 1. is_striped:
    pixels (H, W) whose edges are those of stripes, not of surfaces. The result lies between two disparities, where
    two lines of one slope through its neighbours meet. A pixel is sure if its disparity costs far less than the mean.
    """
    directions = [at for at in product((-1, 0, 1), repeat=2) if any(at)]
    halves = np.zeros((2, *costs.shape), np.uint16)

    def sum_paths(half: int) -> None:
        for down, across in directions[half::2]:
            raise_if_stopped()
            _add_path(costs, colors, is_striped, down, across, halves[half])

    in_pieces(sum_paths, range(2), tiling.THREADS)
    halves[0] += halves[1]
    values, sureness = np.empty(costs.shape[:2], np.float32), np.empty(costs.shape[:2], np.float32)
    _choose(halves[0], costs, disparities, values, sureness)
    return values, sureness


@kernel
def _add_path(costs, colors, is_striped, down, across, sums):
    """Add the costs of the cheapest path that comes from one direction (equation 13 of the paper).

    Stripes are no edges. Loops over disparities have no branches, so that one instruction takes several of them.
    """
    height, width, count = costs.shape
    previous = np.full((width, count + 2), UNREACHED, np.uint16)
    current = previous.copy()
    previous_min, current_min = np.zeros(width, np.uint16), np.zeros(width, np.uint16)
    for row in range(height):
        y = height - 1 - row if down < 0 else row
        before, before_min = (current, current_min) if down == 0 else (previous, previous_min)
        for column in range(width):
            x = width - 1 - column if across < 0 else column
            v, u = y - down, x - across
            cost, path, total = costs[y, x], current[x], sums[y, x]
            if v >= 0 and v < height and u >= 0 and u < width:
                edge = np.float32(0)
                for channel in range(3 if not (is_striped[y, x] and is_striped[v, u]) else 0):
                    edge = max(edge, abs(colors[y, x, channel] - colors[v, u, channel]))
                jump = max(np.float32(STEP_COST), np.float32(JUMP_COST) * np.exp(-edge / np.float32(EDGE_COLOR)))
                source, lowest = before[u], before_min[u]
                limit = np.uint16(lowest + np.uint16(jump + np.float32(0.5)))
                for index in range(count):
                    beside = np.uint16(min(source[index], source[index + 2]) + np.uint16(STEP_COST))
                    best = min(min(source[index + 1], limit), beside)
                    path[index + 1] = np.uint16(cost[index] + np.uint16(best - lowest))
            else:
                for index in range(count):
                    path[index + 1] = cost[index]
            least = path[1]
            for index in range(count):
                least = min(least, path[index + 1])
                total[index] = np.uint16(total[index] + path[index + 1])
            current_min[x] = least
        previous, current = current, previous
        previous_min, current_min = current_min, previous_min


@kernel
def _choose(sums, costs, disparities, values, sureness):
    """Take the disparity with the lowest sum, moved to where two lines of one slope meet."""
    height, width, count = costs.shape
    for y in range(height):
        for x in range(width):
            best, mean, totals = 0, np.float32(0), sums[y, x]
            for index in range(count):
                mean += costs[y, x, index]
                if totals[index] < totals[best]:
                    best = index
            mean /= count
            sureness[y, x] = max(mean - costs[y, x, best], np.float32(0)) / max(mean, np.float32(1))
            values[y, x] = disparities[best]
            if best > 0 and best < count - 1:
                below, above = np.float32(totals[best - 1]), np.float32(totals[best + 1])
                bend = max(below, above) - np.float32(totals[best])
                if bend > 0:
                    values[y, x] += (disparities[1] - disparities[0]) * np.float32(0.5) * (below - above) / bend
