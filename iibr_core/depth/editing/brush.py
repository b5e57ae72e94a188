"""The reach of a brush stroke: geodesic distance from its path, on a picture of how far colours differ from those that
the stroke touched. So strokes end at the photo's contours, and texture that they run over does not stop them.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import Stroke
from iibr_core.depth.geodesic import spread_distances
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

CONTOUR_CONTRAST = 0.12
"""Change of colour (sRGB-encoded, root of the summed squares) that ends a stroke."""
LIKENESS = 0.08
"""Difference between colours of one surface."""
TOUCH_RADII = 0.15
"""Distance from the stroke's points, in radii, in which colours count as touched."""
TOUCH_POINTS = 8
"""Number of the last points whose colours count: earlier ones may lie on another surface."""
SPECK_PIXELS = 3
"""Largest number of pixels with other colours in a square of 3 x 3 that counts as texture."""
SMOOTHING_ROUNDS = 3

Window = tuple[slice, slice]
Places = NDArray[np.float64]


def falloff(distance: FloatImage) -> FloatImage:
    """Return the share of a stroke's change at distances in radii: 1 in its middle, smoothly to 0 at its radius."""
    return (1 - np.minimum(distance, 1) ** 2) ** 2


def lower_distances(photo: FloatImage, stroke: Stroke, index: int, distance: FloatImage) -> Window:
    """Lower distances (H, W), in radii, 1 = out of reach, to those from the path to the stroke's point of this index.

    Return the window in which they may have changed.
    """
    radius = stroke.radius_px(distance.shape[1])
    ends = _places(stroke, max(index - 1, 0), index, distance.shape)
    window = _window(ends, radius + 1, distance.shape)
    before = distance[window]
    if before.size:
        straight = _straight_distance(ends - (window[1].start, window[0].start), before.shape) / np.float32(radius)
        is_open = straight < before
        part = np.where(is_open & (straight < 1 / radius), straight, np.float32(1))
        colors = np.full(before.shape, 1, np.float32)  # no path crosses pixels that no path from here can shorten
        colors[is_open] = color_distance(photo[window][is_open], touched_colors(photo, stroke, index))
        colors = without_outliers(colors) / np.float32(CONTOUR_CONTRAST)
        spread_distances(colors[..., None], 1 / radius, part)
        np.minimum(before, part, out=before)
    return window


def touched_colors(photo: FloatImage, stroke: Stroke, index: int) -> FloatImage:
    """Return colours (N, 3) that represent those touched by a stroke on its way to the point of this index."""
    height, width = photo.shape[:2]
    places = _places(stroke, max(index - TOUCH_POINTS + 1, 0), index, photo.shape)
    around = np.linspace(-1, 1, 9) * max(TOUCH_RADII * stroke.radius_px(width), 1.0)
    x, y = (np.rint(places[:, axis, None] + around).astype(int) for axis in (0, 1))
    colors = photo[y.clip(0, height - 1)[:, :, None], x.clip(0, width - 1)[:, None, :]].reshape(-1, 3)
    # The mean of the colours in every occupied cube of the colour space.
    cubes = np.floor(colors.astype(np.float64) / LIKENESS) @ (1, 2.0**16, 2.0**32)
    _, members, counts = np.unique(cubes, return_inverse=True, return_counts=True)
    sums = [np.bincount(members, colors[:, channel], len(counts)) for channel in range(3)]
    return (np.stack(sums, axis=1) / counts[:, None]).astype(np.float32)


def color_distance(pixels: FloatImage, colors: FloatImage) -> FloatImage:
    """Return the distances (N,) of pixels (N, 3) from the nearest of `colors` (M, 3), beyond LIKENESS."""
    distance = np.empty(len(pixels), np.float32)
    _measure_colors(np.ascontiguousarray(pixels), colors, distance)
    return distance


def without_outliers(colors: FloatImage) -> FloatImage:
    """Return color distances (H, W), 0 for pixels that few neighbours resemble."""
    result = colors.copy()
    _remove_outliers(np.ascontiguousarray(colors), result)
    return result


def smooth_within_contours(photo: FloatImage, disparity: FloatImage, radius: float) -> FloatImage:
    """Return the map (H, W), smoothed over about `radius` px, not across the photo's contours.

    The recursive filter of Gastal and Oliveira, "Domain transform for edge-aware image and video processing" (2011).
    """
    # A step of one pixel, longer by the difference of the colours: a contour counts as three radii.
    contours = [np.sqrt(np.square(np.diff(turned, axis=1)).sum(axis=2)) for turned in (photo, photo.swapaxes(0, 1))]
    steps = [1 + 3 * radius / CONTOUR_CONTRAST * contour for contour in contours]
    values = np.array(disparity, np.float32, order="C")
    for k in range(SMOOTHING_ROUNDS):
        # Every round is half as wide as the previous one; their variances sum to radius^2.
        sigma = radius * sqrt(3) * 2 ** (SMOOTHING_ROUNDS - k - 1) / sqrt(4**SMOOTHING_ROUNDS - 1)
        for step in steps:
            _smooth_rows(values, np.ascontiguousarray(np.exp(-sqrt(2) / sigma * step)))
            values = np.ascontiguousarray(values.T)
    return values


def _places(stroke: Stroke, first: int, last: int, shape: tuple[int, ...]) -> Places:
    """Return points of a stroke (N, 2), (x, y) in pixels, not further outside than the photo is large."""
    return np.clip(stroke.points[first : last + 1], -1, 2) * (shape[1], shape[0]) - 0.5


def _window(places: Places, reach: float, shape: tuple[int, ...]) -> Window:
    """Return the pixels of an image (H, W) up to a reach around places."""
    size = (shape[1], shape[0])
    first = np.clip(np.floor(places.min(axis=0) - reach), 0, size).astype(int)
    last = np.clip(np.ceil(places.max(axis=0) + reach) + 1, 0, size).astype(int)
    return slice(int(first[1]), int(last[1])), slice(int(first[0]), int(last[0]))


def _straight_distance(ends: Places, shape: tuple[int, ...]) -> FloatImage:
    """Return the distances (H, W), in pixels, from the line between two places."""
    (x0, y0), (x1, y1) = ends[0].astype(np.float32), ends[-1].astype(np.float32)
    x, y = np.arange(shape[1], dtype=np.float32) - x0, np.arange(shape[0], dtype=np.float32)[:, None] - y0
    along, down = x1 - x0, y1 - y0
    share = np.clip((x * along + y * down) / np.maximum(along**2 + down**2, np.float32(1e-9)), 0, 1)
    return np.asarray(np.hypot(x - share * along, y - share * down))


@kernel
def _measure_colors(pixels, colors, distance):
    """Fill the distances of `color_distance`."""
    for k in range(pixels.shape[0]):
        least = np.float32(np.inf)
        for n in range(colors.shape[0]):
            red, green, blue = pixels[k, 0] - colors[n, 0], pixels[k, 1] - colors[n, 1], pixels[k, 2] - colors[n, 2]
            least = min(least, red * red + green * green + blue * blue)
            if least < np.float32(LIKENESS**2):
                break
        distance[k] = max(sqrt(least) - np.float32(LIKENESS), np.float32(0))


@kernel
def _remove_outliers(colors, result):
    """Set the result to 0 where few pixels in a square of 3 x 3 have another colour."""
    height, width = result.shape
    for y in range(height):
        for x in range(width):
            if colors[y, x] > 0:
                count = 0
                for v in range(max(y - 1, 0), min(y + 2, height)):
                    for u in range(max(x - 1, 0), min(x + 2, width)):
                        count += colors[v, u] > 0
                if count <= SPECK_PIXELS:
                    result[y, x] = 0


@kernel
def _smooth_rows(values, kept):
    """Smooth every row (H, W) to and fro. kept: share of the mean before it that every pixel but the first takes."""
    height, width = values.shape
    for y in range(height):
        for x in range(1, width):
            values[y, x] += kept[y, x - 1] * (values[y, x - 1] - values[y, x])
        for x in range(width - 2, -1, -1):
            values[y, x] += kept[y, x] * (values[y, x + 1] - values[y, x])
