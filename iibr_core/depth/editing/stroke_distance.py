"""How far pixels are from a stroke of the brush. It is measured along the way, and to come to colours that the stroke
did not touch counts like going far: so strokes end at the photo's contours, texture that they run over does not stop
them, and what lies behind a surface is spared.
"""

from __future__ import annotations

from math import ceil, hypot, sqrt

import numpy as np

from iibr_core.depth.editing.edits import Stroke
from iibr_core.depth.editing.touched_colors import (
    CUBES,
    UNSEEN,
    Guide,
    mark_unlike,
    pixel_span,
    stroke_colours,
    unlikeness,
)
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.types import FloatImage, ImageSize

CONTOUR_CONTRAST = 0.12
"""A difference in colour (sRGB-encoded, root of the summed squares) that ends a stroke, beyond `LIKENESS`."""
SPECK_PIXELS = 3
"""So few unlike pixels in a square of 3 x 3 are texture."""
ROUNDED = 1e-3
"""More than rounding takes off a distance."""
HALF_UP_PX = 1e-6
"""Added to places: what lies between two pixels, but for rounding, belongs to the second."""
SAME = np.float32(1e-6)
"""Distances that differ by less are one: a stroke that runs back over itself begins no ways again."""
UNKNOWN = np.float32(-1.0)
UNQUEUED, LAST = np.int32(-2), np.int32(-1)

Window = tuple[slice, slice]


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
    radius = stroke.radius_px(size.width)
    xs, ys = zip(*ends)
    reach = ceil(radius) + 1
    rows, columns = pixel_span(ys, reach, size.height), pixel_span(xs, reach, size.width)
    if distance[rows, columns].size:
        colors = stroke_colours(guide, stroke, index)
        (x0, y0), (x1, y1) = (
            (float(np.clip(x, -1e6, 1e6)) - columns.start, float(np.clip(y, -1e6, 1e6)) - rows.start)
            for x, y in (ends[0], ends[-1])
        )
        _measure(guide, colors, distance, rows, columns, x0, y0, x1, y1, radius)
    return rows, columns


@kernel
def falloff(distance):
    """How much a brush does at a distance (1 = its radius), or at many: 1 in its middle, smoothly to 0."""
    inside = np.float32(1.0) - np.minimum(distance, np.float32(1.0)) ** 2
    return inside * inside


@kernel
def _measure(whole_guide, colors, whole_distance, rows, columns, x0, y0, x1, y1, radius):
    """Shortest ways (8 neighbours) from the way from (x0, y0) to (x1, y1); to a pixel of a more unlike colour the way
    is longer. rows, columns: the window, in which the places are counted.
    """
    # Cut out here: what a slice is to Numba depends on whether it is as wide as the photo.
    guide = np.ascontiguousarray(whole_guide[rows.start : rows.stop + 2, columns.start : columns.stop + 2])
    distance, flat = whole_distance[rows, columns], guide.reshape(-1, guide.shape[2])
    height, width = distance.shape
    # Pixels have one index, in rows with the border, which no way is short enough to enter.
    pitch, size = width + 2, (height + 2) * (width + 2)
    bordered = np.full((height + 2, pitch), UNKNOWN, np.float32)
    bordered[1:-1, 1:-1] = distance
    away, climb = bordered.reshape(size), _climbs(guide, colors, distance, x0, y0, x1, y1, radius).reshape(size)
    # Pixels wait in buckets, each one step wide, so that none becomes nearer once its bucket's turn has come (Dial
    # 1969). A bucket is a list of entries; one that becomes nearer gets an entry in another, and the old one is void.
    # A pixel becomes nearer by each of its neighbours once at most: memory is taken only for the entries there are.
    first = np.full(ceil(radius) + 1, LAST, np.int32)
    bucket_of = np.full(size, UNQUEUED, np.int32)
    steps = max(ceil(2 * hypot(x1 - x0, y1 - y0)), 1)  # two places a pixel, so that none is stepped over
    most = 8 * size + steps + 1
    pixels, after, count, per_step = np.empty(most, np.int32), np.empty(most, np.int32), 0, np.float32(radius)
    for k in range(steps + 1):
        x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
        column, row = nearest_pixel(x + HALF_UP_PX), nearest_pixel(y + HALF_UP_PX)
        if 0 <= row < height and 0 <= column < width:
            # Seeds of the ways: the exact distance from the path, in radii.
            seed, at = np.float32(hypot(column - x, row - y) / radius), (row + 1) * pitch + column + 1
            if seed < away[at] - SAME:
                away[at], bucket = seed, int(seed * per_step)
                bucket_of[at], pixels[count], after[count], first[bucket] = bucket, at, first[bucket], count
                count += 1
    straight, diagonal = np.float32(1.0 / radius), np.float32(sqrt(2.0) / radius)
    around = np.array((-pitch, -1, 1, pitch, -pitch - 1, -pitch + 1, pitch - 1, pitch + 1))
    for bucket in range(first.size):
        while first[bucket] >= 0:
            at, first[bucket] = pixels[first[bucket]], after[first[bucket]]
            if bucket_of[at] != bucket:
                continue
            bucket_of[at] = UNQUEUED
            here, own = away[at], climb[at]
            if here + straight >= 1.0:
                continue
            if own < 0.0:
                own = unlikeness(flat[at, 0], flat[at, 1], flat[at, 2], colors)
            for k in range(8):
                other, there = at + around[k], here + (straight if k < 4 else diagonal)
                if not there < away[other]:
                    continue
                # A step, and the climb to a less alike colour; to come back to an alike one is free.
                if climb[other] != 0.0:
                    if climb[other] < 0.0:
                        climb[other] = unlikeness(flat[other, 0], flat[other, 1], flat[other, 2], colors)
                    there += max(climb[other] - own, np.float32(0.0)) / np.float32(CONTOUR_CONTRAST)
                    if not there < away[other]:
                        continue
                away[other], new = there, int(there * per_step)
                if bucket_of[other] != new:
                    bucket_of[other], pixels[count], after[count], first[new] = new, other, first[new], count
                    count += 1
    distance[:] = bordered[1:-1, 1:-1]


@kernel
def _climbs(guide, colors, distance, x0, y0, x1, y1, radius):
    """How unlike pixels are where distances may become shorter; UNKNOWN where that is not 0. With a border."""
    height, width = distance.shape
    starts, stops = np.full(height + 2, width + 1), np.zeros(height + 2, np.int64)
    for y in range(height):
        start, stop = 0, width
        while start < stop and not _may_shorten(distance[y, start], start, y, x0, y0, x1, y1, radius):
            start += 1
        while start < stop and not _may_shorten(distance[y, stop - 1], stop - 1, y, x0, y0, x1, y1, radius):
            stop -= 1
        if start < stop:
            starts[y + 1], stops[y + 1] = start + 1, stop + 1
    is_unlike, cubes = np.zeros((height + 2, width + 2), np.uint8), np.full(CUBES, UNSEEN)
    for y in range(1, height + 1):
        start, stop = min(starts[y - 1], starts[y], starts[y + 1]), max(stops[y - 1], stops[y], stops[y + 1])
        mark_unlike(guide, colors, cubes, y, max(start - 1, 1), min(stop + 1, width + 1), is_unlike)
    climb = np.zeros((height + 2, width + 2), np.float32)
    for y in range(1, height + 1):
        for x in range(starts[y], stops[y]):
            count = 0
            for j in range(y - 1, y + 2):
                count += is_unlike[j, x - 1] + is_unlike[j, x] + is_unlike[j, x + 1]
            # What few of a pixel's neighbours share is no other surface.
            climb[y, x] = UNKNOWN if is_unlike[y, x] and count > SPECK_PIXELS else np.float32(0.0)
    return climb


@kernel
def _may_shorten(distance, x, y, x0, y0, x1, y1, radius):
    """Whether the way from (x0, y0) to (x1, y1) may shorten a distance: no way is shorter than straight ahead."""
    along, down = x1 - x0, y1 - y0
    share = ((x - x0) * along + (y - y0) * down) / max(along * along + down * down, 1e-9)
    share = min(max(share, 0.0), 1.0)
    square = (x - x0 - share * along) ** 2 + (y - y0 - share * down) ** 2
    return square < ((distance + ROUNDED) * radius) ** 2
