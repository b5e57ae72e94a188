"""How far pixels are from a stroke of the brush. It is measured along the way, and to come to colours that the stroke
did not touch counts like going far: so strokes end at the photo's contours, texture that they run over does not stop
them, and what lies behind a surface is spared.
"""

from __future__ import annotations

from math import ceil, floor, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import Stroke
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.types import FloatImage, ImageSize

CONTOUR_CONTRAST = 0.12
"""A difference in colour (sRGB-encoded, root of the summed squares) that ends a stroke, beyond `LIKENESS`."""
LIKENESS = 0.08
"""Colours so near to one that the stroke touched are the same surface."""
TOUCH_RADII = 0.15
"""Colours so near to its path are touched, ..."""
TOUCH_POINTS = 8
"""... for so many of its points: then it may have come to another surface."""
SPECK_PIXELS = 3
"""So few unlike pixels in a square of 3 x 3 are texture."""
COLOR_BIN = 0.1
MOST_TOUCHED = 4000

GUIDE_STEPS = 1024
"""Of a guide's integers from black to white: processors compare many integers at once, floats one by one."""
DARKEST, BRIGHTEST = -2.0, 20.0
"""Of HDR: squares of the differences fit 32 bits."""

UNKNOWN = np.float32(-1.0)
UNQUEUED, LAST = np.int32(-2), np.int32(-1)

Guide = NDArray[np.int16]
"""(H + 2, W + 2, 3): a photo in `GUIDE_STEPS`, with a border of one pixel that nothing reads for its colour."""
Colors = NDArray[np.int32]
"""(3, N), in `GUIDE_STEPS`."""
Window = tuple[slice, slice]


def guide_of(photo: FloatImage) -> Guide:
    """The photo (H, W, 3), sRGB-encoded, as strokes are measured on it."""
    height, width = photo.shape[:2]
    guide = np.zeros((height + 2, width + 2, 3), np.int16)
    finite = np.nan_to_num(photo, nan=0.0, posinf=BRIGHTEST, neginf=DARKEST)
    guide[1:-1, 1:-1] = np.rint(np.clip(finite, DARKEST, BRIGHTEST) * np.float32(GUIDE_STEPS))
    return guide


def stroke_distance(guide: Guide, stroke: Stroke) -> FloatImage:
    """How far every pixel is from a stroke, in its radii: (H, W), 1 = out of reach."""
    distance = np.ones((guide.shape[0] - 2, guide.shape[1] - 2), np.float32)
    for i in range(len(stroke.points)):
        measure_from(guide, stroke, i, distance)
    return distance


def measure_from(guide: Guide, stroke: Stroke, index: int, distance: FloatImage) -> Window:
    """Shorten the distances (H, W) to what they are from the way to the stroke's point of this index.

    Returns the window in which they may have changed.
    """
    size = ImageSize(*distance.shape)
    ends = [(x * size.width - 0.5, y * size.height - 0.5) for x, y in stroke.points[max(index - 1, 0) : index + 1]]
    radius = radius_px(stroke, size)
    xs, ys = zip(*ends)
    reach = ceil(radius) + 1
    rows, columns = _span(ys, reach, size.height), _span(xs, reach, size.width)
    if distance[rows, columns].size:
        bordered = guide[rows.start : rows.stop + 2, columns.start : columns.stop + 2]
        colors = stroke_colours(guide, stroke, index)
        (x0, y0), (x1, y1) = (
            (float(np.clip(x, -1e6, 1e6)) - columns.start, float(np.clip(y, -1e6, 1e6)) - rows.start)
            for x, y in (ends[0], ends[-1])
        )
        _measure(np.ascontiguousarray(bordered), colors, distance[rows, columns], x0, y0, x1, y1, radius)
    return rows, columns


def radius_px(stroke: Stroke, size: ImageSize) -> float:
    """The brush's radius in pixels of a map, at least one."""
    return max(stroke.radius * size.width, 1.0)


def stroke_colours(guide: Guide, stroke: Stroke, index: int) -> Colors:
    """Colours (3, N) that a stroke touched on its way to the point of this index; a few that stand for all."""
    size = ImageSize(guide.shape[0] - 2, guide.shape[1] - 2)
    reach = max(TOUCH_RADII * radius_px(stroke, size), 1.0)
    parts = []
    for x, y in stroke.points[max(index - TOUCH_POINTS + 1, 0) : index + 1]:
        rows = _span((y * size.height - 0.5,), reach, size.height)
        columns = _span((x * size.width - 0.5,), reach, size.width)
        parts.append(guide[1:-1, 1:-1][rows, columns].reshape(-1, 3))
    colors = np.concatenate(parts)
    colors = colors[:: max(1, len(colors) // MOST_TOUCHED)].astype(np.int64)
    across = int((BRIGHTEST - DARKEST) / COLOR_BIN) + 1
    bins = (colors - int(DARKEST * GUIDE_STEPS)) // int(COLOR_BIN * GUIDE_STEPS) @ (across**2, across, 1)
    _, bins, counts = np.unique(bins, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(bins, colors[:, channel], len(counts)) for channel in range(3)])
    means: Colors = np.rint(sums / counts).astype(np.int32)
    return means


def _span(places: tuple[float, ...], reach: float, size: int) -> slice:
    """Pixels from so far before the first of the places to so far after the last, as far as there are any."""
    first, last = (int(min(max(at, 0), size)) for at in (floor(min(places) - reach), ceil(max(places) + reach) + 1))
    return slice(first, last)


@kernel
def falloff(distance):
    """How much a brush does at a distance (1 = its radius), or at many: 1 in its middle, smoothly to 0."""
    inside = np.float32(1.0) - np.minimum(distance, np.float32(1.0)) ** 2
    return inside * inside


@kernel
def unlikeness(red, green, blue, colors):
    """How far a colour of a guide is from the nearest of these, beyond `LIKENESS`; without any, all are alike."""
    # No way out of the loop: so it compares several colours at a time.
    least = np.int32(2**31 - 1) if colors.shape[1] else np.int32(0)
    for c in range(colors.shape[1]):
        total = (red - colors[0, c]) ** 2 + (green - colors[1, c]) ** 2 + (blue - colors[2, c]) ** 2
        least = min(least, np.int32(total))
    return max(np.float32(sqrt(np.float32(least))) / np.float32(GUIDE_STEPS) - np.float32(LIKENESS), np.float32(0.0))


@kernel
def _measure(guide, colors, distance, x0, y0, x1, y1, radius):
    """Shortest ways (8 neighbours) from the way from (x0, y0) to (x1, y1); to a pixel of a more unlike colour the way
    is longer. guide: of the window of these distances, with its border.
    """
    height, width = distance.shape
    # Pixels have one index, in rows with the border, which no way is short enough to enter.
    pitch, size = width + 2, (height + 2) * (width + 2)
    photo = guide.reshape(size, 3)
    away = np.full(size, UNKNOWN, np.float32)
    climb, unlike = np.full(size, UNKNOWN, np.float32), np.zeros(size, np.float32)
    for y in range(height):
        start = (y + 1) * pitch + 1
        for x in range(width):
            away[start + x], unlike[start + x] = distance[y, x], UNKNOWN
    # Pixels wait in buckets, each one step wide, so that none becomes nearer once its bucket's turn has come (Dial
    # 1969). A bucket is a list of pixels linked both ways: one that becomes nearer moves to another.
    per_step = np.float32(radius)
    first = np.full(ceil(radius) + 1, LAST, np.int32)
    after, before = np.empty(size, np.int32), np.full(size, UNQUEUED, np.int32)
    # Two places a pixel, so that none is stepped over.
    steps = max(ceil(2 * hypot(x1 - x0, y1 - y0)), 1)
    for k in range(steps + 1):
        x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
        column, row = nearest_pixel(x), nearest_pixel(y)
        if 0 <= row < height and 0 <= column < width:
            # Seeds of the ways: the exact distance from the path, in radii.
            seed, at = np.float32(hypot(column - x, row - y) / radius), (row + 1) * pitch + column + 1
            if seed < away[at]:
                _queue(at, seed, per_step, away, first, after, before)
    straight, diagonal = np.float32(1.0 / radius), np.float32(sqrt(2.0) / radius)
    around = np.array((0, -pitch - 1, -pitch, -pitch + 1, -1, 1, pitch - 1, pitch, pitch + 1))
    lengths = np.array((0, diagonal, straight, diagonal, straight, straight, diagonal, straight, diagonal), np.float32)
    for bucket in range(first.size):
        while first[bucket] >= 0:
            at = first[bucket]
            first[bucket] = after[at]
            if after[at] >= 0:
                before[after[at]] = LAST
            before[at] = UNQUEUED
            here, own = away[at], np.float32(0.0)
            if here + straight >= 1.0:
                continue
            for k in range(9):
                other, there = at + around[k], here + lengths[k]
                if k > 0 and not there < away[other]:
                    continue
                # What lies around is looked at when the way comes there, once.
                if climb[other] < 0.0:
                    count_unlike = 0
                    for m in range(9):
                        near = other + around[m]
                        if unlike[near] < 0.0:
                            unlike[near] = unlikeness(photo[near, 0], photo[near, 1], photo[near, 2], colors)
                        count_unlike += unlike[near] > 0.0
                    # What few of a pixel's neighbours share is no other surface.
                    climb[other] = unlike[other] if count_unlike > SPECK_PIXELS else np.float32(0.0)
                if k == 0:
                    own = climb[at]
                    continue
                # A step, and the climb to a less alike colour; to come back to an alike one is free.
                there += max(climb[other] - own, np.float32(0.0)) / np.float32(CONTOUR_CONTRAST)
                if there < away[other]:
                    _queue(other, there, per_step, away, first, after, before)
    for y in range(height):
        start = (y + 1) * pitch + 1
        for x in range(width):
            distance[y, x] = away[start + x]


@kernel
def _queue(at, there, per_step, away, first, after, before):
    """Move a pixel to the bucket of its new distance."""
    if before[at] != UNQUEUED:
        if after[at] >= 0:
            before[after[at]] = before[at]
        if before[at] >= 0:
            after[before[at]] = after[at]
        else:
            first[int(away[at] * per_step)] = after[at]
    away[at] = there
    bucket = int(there * per_step)
    after[at], before[at] = first[bucket], LAST
    if first[bucket] >= 0:
        before[first[bucket]] = at
    first[bucket] = at
