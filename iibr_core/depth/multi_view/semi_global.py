"""One disparity for each pixel from the costs of many: semi-global matching (Hirschmüller, PAMI 2008)."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces
from iibr_core.runtime.work import is_stopped, raise_if_stopped
from iibr_core.types import FloatImage

SMALL_STEP_COST = 8
"""Of going from one disparity to the next between neighbouring pixels; costs of matching end at 255."""
JUMP_COST = 240
"""Of any greater step, where the picture shows no edge."""
EDGE_LUMA = 0.02
"""An edge of this much (1 = white) brings the cost of a jump down to a third of it."""
PATHS = [at for at in product((-1, 0, 1), repeat=2) if any(at)]
"""The directions, (y, x), from which neighbours are heard."""


def choose_disparity(
    costs: NDArray[np.uint8], luma: FloatImage, disparities: NDArray[np.float32]
) -> tuple[FloatImage, FloatImage]:
    """The disparity (H, W) that suits each pixel and its neighbours, and how surely, 0 .. 1.

    costs: (H, W, D), 0 .. 255, of D >= 1 evenly spaced disparities. luma: (H, W) of the picture, 0 .. 1: jumps cost
    less at its edges. Between two disparities a parabola through the sums decides. Sure is what matches far better
    than it does on average.
    """
    halves = np.zeros((2, *costs.shape), np.uint16)

    def sum_paths(half: int) -> None:
        for down, across in PATHS[half::2]:
            if is_stopped():
                return
            _add_path(costs, luma, down, across, halves[half])

    in_pieces(sum_paths, range(2), tiling.THREADS)
    raise_if_stopped()
    values, sureness = np.empty(luma.shape, np.float32), np.empty(luma.shape, np.float32)
    _choose(halves[0], halves[1], costs, disparities, values, sureness)
    return values, sureness


@kernel
def _add_path(costs, luma, down, across, sums):
    """Add the costs of the cheapest path that comes from one direction (equation 13 there)."""
    height, width, count = costs.shape
    # Rows one after the other, or columns where the path runs along a row.
    along_row = down == 0
    lines, places = (width, height) if along_row else (height, width)
    before, now = np.zeros((places, count), np.float32), np.zeros((places, count), np.float32)
    least_before, least_now = np.zeros(places, np.float32), np.zeros(places, np.float32)
    forward = across > 0 if along_row else down > 0
    for step in range(lines):
        line = step if forward else lines - 1 - step
        for place in range(places):
            y, x = (place, line) if along_row else (line, place)
            from_y, from_x = y - down, x - across
            has_before = from_y >= 0 and from_y < height and from_x >= 0 and from_x < width
            least = np.float32(np.inf)
            if has_before:
                source = from_y if along_row else from_x
                edge = abs(luma[y, x] - luma[from_y, from_x])
                jump = max(np.float32(SMALL_STEP_COST), np.float32(JUMP_COST) * np.exp(-edge / np.float32(EDGE_LUMA)))
                lowest = least_before[source]
            for index in range(count):
                cost = np.float32(costs[y, x, index])
                if has_before:
                    best = min(before[source, index], lowest + jump)
                    if index > 0:
                        best = min(best, before[source, index - 1] + SMALL_STEP_COST)
                    if index < count - 1:
                        best = min(best, before[source, index + 1] + SMALL_STEP_COST)
                    cost += best - lowest
                now[place, index] = cost
                least = min(least, cost)
                sums[y, x, index] += np.uint16(cost + np.float32(0.5))
            least_now[place] = least
        before, now = now, before
        least_before, least_now = least_now, least_before


@kernel
def _choose(first, second, costs, disparities, values, sureness):
    height, width, count = first.shape
    for y in range(height):
        for x in range(width):
            best, least, mean = 0, np.float32(np.inf), np.float32(0)
            for index in range(count):
                total = np.float32(first[y, x, index]) + np.float32(second[y, x, index])
                mean += costs[y, x, index]
                if total < least:
                    best, least = index, total
            mean /= count
            sureness[y, x] = max(mean - costs[y, x, best], np.float32(0)) / max(mean, np.float32(1))
            value = disparities[best]
            if best > 0 and best < count - 1:
                below = np.float32(first[y, x, best - 1]) + np.float32(second[y, x, best - 1])
                above = np.float32(first[y, x, best + 1]) + np.float32(second[y, x, best + 1])
                bend = below - 2 * least + above
                if bend > 0:
                    value += (disparities[1] - disparities[0]) * np.float32(0.5) * (below - above) / bend
            values[y, x] = value
