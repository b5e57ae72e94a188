"""The surface under a place of the photo, for the bucket: what hangs together, up to edges of photo and depth."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import Stroke
from iibr_core.depth.editing.stroke_distance import CONTOUR_CONTRAST
from iibr_core.depth.editing.touched_colors import GUIDE_STEPS, Guide, stroke_colours, unlikeness
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

BASE_PX = 2
"""What lies so far before and behind a pixel tells whether it is on an edge, also where that is blurred."""
DEPTH_EDGE = 0.05
"""A step of disparity across a pixel that parts surfaces, as a share of the map's range."""
OTHER_SURFACE = 0.25
"""Colours so far from those under the stroke are another surface, however softly one turns into the other."""
EDGE_GAP_PX = 2
"""Edges that lie this near to each other count as one: surfaces do not run out through gaps."""
BLURRED_EDGE_PX = 3
"""Half the width of a blurred edge: so much of it is asked which side it belongs to."""
EDGE, SPACE, SURFACE = np.uint8(0), np.uint8(1), np.uint8(2)


def surface_at(
    guide: Guide, disparity: FloatImage, stroke: Stroke, index: int, extent: tuple[float, float]
) -> NDArray[np.bool_]:
    """The pixels (H, W) of the surface under the stroke's point of this index; none where that lies outside.

    Colours that lie within the stroke's touch are the surface's own: between them there is no edge. Holes smaller than
    the brush are filled. disparity: (H, W), finite. extent: see `extent_of`.
    """
    height, width = disparity.shape
    x, y = stroke.points[index]
    if not (0 <= x < 1 and 0 <= y < 1):
        return np.zeros(disparity.shape, np.bool_)
    step = np.float32(DEPTH_EDGE * (extent[1] - extent[0]))
    parts = np.empty(disparity.shape, np.uint8)
    _find_edges(guide, disparity, stroke_colours(guide, stroke, index), step, parts)
    clearance = np.empty(disparity.shape, np.int32)
    _measure_clearance(parts, clearance)
    row, column = _start_near(clearance, int(y * height), int(x * width))
    gap = min(EDGE_GAP_PX, int(clearance[row, column]) - 1)
    if gap < 0:
        return _is_surface(parts)
    _flood(np.where(clearance > gap, SPACE, EDGE).astype(np.uint8), parts, row, column)
    for _ in range(gap):
        _grow(parts, clearance)
    for _ in range(BLURRED_EDGE_PX):
        _share_edges(guide, disparity, step, parts.copy(), parts)
    _fill_holes(parts, pi * stroke.radius_px(width) ** 2)
    return _is_surface(parts)


def _is_surface(parts: NDArray[np.uint8]) -> NDArray[np.bool_]:
    return np.equal(parts, SURFACE)


def _start_near(clearance: NDArray[np.int32], row: int, column: int) -> tuple[int, int]:
    """The place itself, or on an edge the one nearby that is freest of edges."""
    if clearance[row, column] > 0:
        return row, column
    top, left = max(row - BLURRED_EDGE_PX, 0), max(column - BLURRED_EDGE_PX, 0)
    around = clearance[top : row + BLURRED_EDGE_PX + 1, left : column + BLURRED_EDGE_PX + 1]
    down, across = divmod(int(np.argmax(around)), around.shape[1])
    return top + down, left + across


@kernel
def _find_edges(guide, disparity, colors, depth_step, parts):
    """Tell edges from space, by what lies on both sides of a pixel."""
    height, width = parts.shape
    contrast = (CONTOUR_CONTRAST * GUIDE_STEPS) ** 2
    for y in range(height):
        for x in range(width):
            red, green, blue = guide[y + 1, x + 1]
            parts[y, x] = EDGE if unlikeness(red, green, blue, colors) > OTHER_SURFACE else SPACE
            for turn in range(2):
                down, across = BASE_PX * turn, BASE_PX * (1 - turn)
                top, left = max(y - down, 0), max(x - across, 0)
                bottom, right = min(y + down, height - 1), min(x + across, width - 1)
                # Beyond what it rises before and behind: slants are no edges.
                above, below = disparity[top, left], disparity[bottom, right]
                before = abs(above - disparity[max(top - down, 0), max(left - across, 0)])
                behind = abs(disparity[min(bottom + down, height - 1), min(right + across, width - 1)] - below)
                if abs(below - above) - 2 * max(before, behind) > depth_step:
                    parts[y, x] = EDGE
                red, green, blue = guide[top + 1, left + 1]
                other_red, other_green, other_blue = guide[bottom + 1, right + 1]
                total = (red - other_red) ** 2 + (green - other_green) ** 2 + (blue - other_blue) ** 2
                # Between two colours of the surface it is texture.
                if parts[y, x] == SPACE and total > contrast:
                    is_unlike = unlikeness(red, green, blue, colors) > 0.0
                    if is_unlike or unlikeness(other_red, other_green, other_blue, colors) > 0.0:
                        parts[y, x] = EDGE


@kernel
def _measure_clearance(parts, clearance):
    """How many pixels, also diagonally, lie from here to the nearest edge (Rosenfeld and Pfaltz 1966)."""
    height, width = parts.shape
    for y in range(height):
        for x in range(width):
            least = height + width
            for j in range(max(y - 1, 0), y + 1):
                for i in range(max(x - 1, 0), min(x + 2, width)):
                    if j < y or i < x:
                        least = min(least, clearance[j, i] + 1)
            clearance[y, x] = 0 if parts[y, x] == EDGE else least
    for y in range(height - 1, -1, -1):
        for x in range(width - 1, -1, -1):
            least = clearance[y, x]
            for j in range(y, min(y + 2, height)):
                for i in range(max(x - 1, 0), min(x + 2, width)):
                    if j > y or i > x:
                        least = min(least, clearance[j, i] + 1)
            clearance[y, x] = least


@kernel
def _flood(passable, parts, row, column):
    """Make SURFACE of what is SPACE in `passable` and hangs together with a pixel, over 4 neighbours. passable: is used
    up.
    """
    height, width = parts.shape
    waiting = np.empty(height * width, np.int32)
    waiting[0], count = row * width + column, 1
    passable[row, column] = EDGE
    while count > 0:
        count -= 1
        y, x = waiting[count] // width, waiting[count] % width
        parts[y, x] = SURFACE
        for turn in range(4):
            j, i = y + (turn == 0) - (turn == 1), x + (turn == 2) - (turn == 3)
            if 0 <= j < height and 0 <= i < width and passable[j, i] == SPACE:
                passable[j, i] = EDGE
                waiting[count] = j * width + i
                count += 1


@kernel
def _grow(parts, clearance):
    """Give the surface back what closing gaps took: the pixels beside it that are no edge themselves."""
    height, width = parts.shape
    for y in range(height):
        for x in range(width):
            if parts[y, x] != SPACE:
                continue
            # Where there is more room, the surface would have come by itself.
            for j in range(max(y - 1, 0), min(y + 2, height)):
                for i in range(max(x - 1, 0), min(x + 2, width)):
                    if parts[j, i] == SURFACE and clearance[j, i] > clearance[y, x]:
                        parts[y, x] = SURFACE


@kernel
def _share_edges(guide, disparity, depth_step, before, parts):
    """Edges belong to the side that they look like: to the surface if to that, seen across the edge."""
    height, width = parts.shape
    for y in range(height):
        for x in range(width):
            if before[y, x] != EDGE:
                continue
            for turn in range(4):
                down, across = (turn == 0) - (turn == 1), (turn == 2) - (turn == 3)
                j, i = y + down, x + across
                if not (0 <= j < height and 0 <= i < width and before[j, i] == SURFACE):
                    continue
                # The other side: the first pixel that is no edge, or the last one of a wide edge.
                m, n = y, x
                for _ in range(2 * BLURRED_EDGE_PX):
                    if not (0 <= m - down < height and 0 <= n - across < width):
                        break
                    m, n = m - down, n - across
                    if before[m, n] != EDGE:
                        break
                if before[m, n] == SURFACE or _difference(
                    guide[y + 1, x + 1], guide[j + 1, i + 1], disparity[y, x] - disparity[j, i], depth_step
                ) <= _difference(
                    guide[y + 1, x + 1], guide[m + 1, n + 1], disparity[y, x] - disparity[m, n], depth_step
                ):
                    parts[y, x] = SURFACE
                    break


@kernel
def _difference(color, other, depth, depth_step):
    """Between two pixels, in steps that part surfaces."""
    total = np.float32(0.0)
    for c in range(3):
        total += (np.float32(color[c]) - np.float32(other[c])) ** 2
    return np.sqrt(total) / (CONTOUR_CONTRAST * GUIDE_STEPS) + abs(depth) / depth_step


@kernel
def _fill_holes(parts, most_pixels):
    """Make surface of what lies within it, up to so many pixels a hole."""
    height, width = parts.shape
    seen = np.zeros((height, width), np.uint8)
    waiting = np.empty(height * width, np.int32)
    for start in range(height * width):
        if parts[start // width, start % width] == SURFACE or seen[start // width, start % width] == 1:
            continue
        # What hangs together here (4 neighbours): `waiting` keeps all of it, up to `end`.
        waiting[0], at, end, is_enclosed = start, 0, 1, True
        seen[start // width, start % width] = 1
        while at < end:
            y, x = waiting[at] // width, waiting[at] % width
            at += 1
            is_enclosed &= 0 < y < height - 1 and 0 < x < width - 1
            for turn in range(4):
                j, i = y + (turn == 0) - (turn == 1), x + (turn == 2) - (turn == 3)
                if 0 <= j < height and 0 <= i < width and parts[j, i] != SURFACE and seen[j, i] == 0:
                    seen[j, i] = 1
                    waiting[end] = j * width + i
                    end += 1
        if is_enclosed and end <= most_pixels:
            for k in range(end):
                parts[waiting[k] // width, waiting[k] % width] = SURFACE
