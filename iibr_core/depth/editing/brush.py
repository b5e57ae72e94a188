"""Strokes of a brush on a disparity map. They end at the photo's contours: how far a pixel is from the stroke is
measured along the way, and to come to colours that the stroke did not touch counts like going far. So texture that the
stroke runs over does not stop it, and what lies behind a surface is spared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, exp, floor, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import UNEDITED, BrushTool, DepthEdits, Stroke, apply_tone, extent_of, require_sound
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.types import FloatImage

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
MOST_BIN = 10_000
MOST_TOUCHED = 4000
NOISE_MEDIANS = 2.5
"""Differences between neighbours below so many medians of them are texture, no contour."""
MOST_NOISE = 0.03
MOST_VISITS = 16
"""Of a pixel on average, to measure ways: two or three do unless the ways wind like a maze's."""
UNKNOWN = -1.0
ALIKE = np.float32(LIKENESS**2)
FAR = np.float32(1e30)
MAPS_KEPT = 8
"""Of those before the last strokes: so many can be taken back at once."""
SMOOTHING_ROUNDS = 3
PARTING_RADII = 3.0
"""A contour parts what is smoothed like going so many radii."""

Window = tuple[slice, slice]
_SIGNS: dict[BrushTool, float] = {"nearer": 1.0, "farther": -1.0, "smooth": 1.0}
MOST = float(np.finfo(np.float32).max)


def apply_edits(photo: FloatImage, disparity: FloatImage, edits: DepthEdits) -> FloatImage:
    """The map with all its edits: (H, W) float32, finite; the map itself where nothing is edited.

    photo: (H, W, 3), sRGB-encoded, guides the strokes. disparity: (H, W), any unit in which larger is closer.
    Raises InputError where the edits are not sound (see `require_sound`) or no disparity is known.
    """
    return DepthCanvas(photo, disparity).apply(edits)


class DepthCanvas:
    """A map that follows its edits: where they only go on, only what is new is worked out.

    `shown` gives the same as `apply_edits`, to the bit, whatever was shown before.
    """

    def __init__(self, photo: FloatImage, disparity: FloatImage) -> None:
        """photo: (H, W, 3), sRGB-encoded; disparity: (H, W). Raises ValueError where the sizes differ."""
        if photo.shape != (*disparity.shape, 3):
            raise ValueError(f"the photo is {photo.shape}, the disparity {disparity.shape}")
        self._photo, self._given = photo, np.asarray(disparity, np.float32)
        self._is_known = bool(np.isfinite(self._given).all())
        self._extent: tuple[float, float] | None = None
        self._noise: float | None = None
        self._edits = UNEDITED.tone
        self._toned: FloatImage | None = None
        self._values: FloatImage = self._given
        self._open: _OpenStroke | None = None
        self._trail: list[tuple[int, FloatImage]] = []  # (strokes, map) before the last ones, to go back to

    def apply(self, edits: DepthEdits) -> FloatImage:
        """The map with these edits, (H, W) float32; not to be written to. Raises InputError as `apply_edits` does."""
        if edits == UNEDITED and self._is_known:
            return self._given
        require_sound(edits)
        self._extent = self._extent or extent_of(self._given)
        if self._toned is None or self._edits.tone != edits.tone:
            self._toned = apply_tone(self._given, edits, self._extent)
            self._forget(edits)
        self._return_to(edits)
        for stroke in edits.strokes[len(self._edits.strokes) :]:
            self._begin(stroke)
        return self._values

    def before_strokes(self, edits: DepthEdits) -> FloatImage:
        """The map without the strokes of these edits: what stays as it is where the brush does not go."""
        self.apply(edits)
        return self._given if self._toned is None else self._toned

    def _forget(self, edits: DepthEdits) -> None:
        assert self._toned is not None
        self._edits, self._values, self._open = edits.tone, self._toned, None
        self._trail.clear()

    def _return_to(self, edits: DepthEdits) -> None:
        """Keep of what was painted what these strokes begin with, and go on with the last one if it became longer."""
        done, wanted = self._edits.strokes, edits.strokes
        if wanted[: len(done)] == done:
            return
        alike = next((i for i, (a, b) in enumerate(zip(done, wanted)) if a != b), min(len(done), len(wanted)))
        is_last = self._open is not None and alike == len(done) - 1 < len(wanted)
        if is_last and _goes_on(done[-1], wanted[alike]):
            self._go_on(wanted[alike], first=len(done[-1].points))
            return
        while self._trail and self._trail[-1][0] > alike:
            self._trail.pop()
        if not self._trail:
            self._forget(edits)
            return
        count, self._values = self._trail.pop()
        self._open, self._edits = None, replace(self._edits, strokes=done[:count])

    def _begin(self, stroke: Stroke) -> None:
        target, under = None, self._values
        self._trail = [*self._trail, (len(self._edits.strokes), under)][-MAPS_KEPT:]
        if stroke.tool == "smooth":
            target = smooth_within_contours(self._photo, under, radius_px(stroke, under), self._texture())
        self._open = _OpenStroke(under, np.ones(under.shape, np.float32), target)
        self._edits = replace(self._edits, strokes=(*self._edits.strokes, stroke))
        self._paint(stroke, first=0)

    def _go_on(self, stroke: Stroke, first: int) -> None:
        self._edits = replace(self._edits, strokes=(*self._edits.strokes[:-1], stroke))
        self._paint(stroke, first)

    def _texture(self) -> float:
        self._noise = texture_contrast(self._photo) if self._noise is None else self._noise
        return self._noise

    def _paint(self, stroke: Stroke, first: int) -> None:
        """Lay the stroke on the map, from its point of this index on. Maps handed out before stay as they are."""
        assert self._open is not None
        assert self._extent is not None
        under, distance, target = self._open.under, self._open.distance, self._open.target
        amount = stroke.strength * (self._extent[1] - self._extent[0]) * _SIGNS[stroke.tool]
        values = self._values.copy()
        for i in range(first, len(stroke.points)):
            window, touched = _measure_from(self._photo, stroke, i, distance)
            if target is None:
                _move(values[window], under[window], distance[window], touched, amount)
            else:
                _blend(values[window], under[window], target[window], distance[window], touched, stroke.strength)
        self._values = values


@dataclass(frozen=True, eq=False)
class _OpenStroke:
    """The last stroke, which may go on. under: the map without it. distance: of every pixel from it, 1 = out of reach.

    target: the smoothed map, for "smooth".
    """

    under: FloatImage
    distance: FloatImage
    target: FloatImage | None


def radius_px(stroke: Stroke, disparity: FloatImage) -> float:
    """The brush's radius in pixels of a map, at least one."""
    return max(stroke.radius * int(disparity.shape[1]), 1.0)


def texture_contrast(photo: FloatImage) -> float:
    """Difference in colour between neighbours of a photo (H, W, 3) below which it is texture or noise."""
    step = max(1, photo.shape[0] * photo.shape[1] // 500_000)
    differences = [
        np.sqrt(np.square(np.diff(rows, axis=1)).sum(axis=2)).reshape(-1)
        for rows in (photo[::step], photo[:, ::step].swapaxes(0, 1))
    ]
    both = np.concatenate(differences)
    return min(NOISE_MEDIANS * float(np.median(both)), MOST_NOISE) if both.size else 0.0


def stroke_distance(photo: FloatImage, stroke: Stroke) -> FloatImage:
    """How far every pixel of a photo (H, W, 3) is from a stroke, in its radii: (H, W), 1 = out of reach."""
    distance = np.ones(photo.shape[:2], np.float32)
    for i in range(len(stroke.points)):
        _measure_from(photo, stroke, i, distance)
    return distance


def stroke_colours(photo: FloatImage, stroke: Stroke, index: int) -> FloatImage:
    """Colours (N, 3) that a stroke touched on its way to the point of this index; a few that stand for all."""
    height, width = photo.shape[:2]
    reach = max(TOUCH_RADII * radius_px(stroke, photo[..., 0]), 1.0)
    parts = []
    for x, y in stroke.points[max(index - TOUCH_POINTS + 1, 0) : index + 1]:
        rows, columns = (
            _span(at * size - 0.5 - reach, at * size - 0.5 + reach, size) for at, size in ((y, height), (x, width))
        )
        parts.append(photo[rows, columns].reshape(-1, 3))
    colors = np.concatenate(parts)
    colors = colors[:: max(1, len(colors) // MOST_TOUCHED)]
    bins = np.clip(np.floor(colors / COLOR_BIN), 0, MOST_BIN).astype(np.int64) @ (MOST_BIN**2, MOST_BIN, 1)
    _, bins, counts = np.unique(bins, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(bins, colors[:, channel], len(counts)) for channel in range(3)], axis=-1)
    often_first = np.argsort(-counts, kind="stable")  # most pixels are like them: the others are not asked
    return (sums / counts[:, None])[often_first].astype(np.float32)


def smooth_within_contours(photo: FloatImage, disparity: FloatImage, radius: float, noise: float) -> FloatImage:
    """The map (H, W), smoothed over about `radius` px, not across the photo's contours.

    The recursive filter of Gastal and Oliveira, "Domain transform for edge-aware image and video processing" (2011).
    noise: see `texture_contrast`.
    """
    parting = PARTING_RADII * radius / CONTOUR_CONTRAST
    steps = [np.ones(shape, np.float32) for shape in (disparity.shape, disparity.shape[::-1])]
    for turned, step in zip((photo, np.ascontiguousarray(photo.swapaxes(0, 1))), steps):
        _measure_steps(turned, parting, noise, step)
    values = np.array(disparity, np.float32, order="C")
    for k in range(SMOOTHING_ROUNDS):
        # Each round half as wide as the one before; their variances sum to radius^2.
        sigma = radius * sqrt(3) * 2 ** (SMOOTHING_ROUNDS - k - 1) / sqrt(4**SMOOTHING_ROUNDS - 1)
        for step in steps:
            _smooth_rows(values, step, sqrt(2) / sigma)
            values = np.ascontiguousarray(values.T)
    return values


def _goes_on(old: Stroke, new: Stroke) -> bool:
    """Whether a stroke is another one, continued."""
    return replace(new, points=old.points) == old and new.points[: len(old.points)] == old.points


def _measure_from(
    photo: FloatImage, stroke: Stroke, index: int, distance: FloatImage
) -> tuple[Window, NDArray[np.uint8]]:
    """Shorten the distances (H, W) to what they are from the way to the stroke's point of this index.

    Returns the window in which they may have changed, and its pixels, 1 where they did: of a stroke's every step
    that is little, all else being nearer to what was painted before.
    """
    height, width = distance.shape
    ends = [(x * width - 0.5, y * height - 0.5) for x, y in stroke.points[max(index - 1, 0) : index + 1]]
    radius = radius_px(stroke, distance)
    xs, ys = zip(*ends)
    reach = ceil(radius) + 1
    window = _span(min(ys) - reach, max(ys) + reach, height), _span(min(xs) - reach, max(xs) + reach, width)
    (x0, y0), (x1, y1) = ends[0], ends[-1]
    x0, y0, x1, y1 = (float(np.clip(at, -1e6, 1e6)) for at in (x0, y0, x1, y1))
    shape = distance[window].shape
    touched = np.zeros(shape, np.uint8)
    if touched.size:
        colors = np.ascontiguousarray(stroke_colours(photo, stroke, index).T)
        ends_in_window = x0 - window[1].start, y0 - window[0].start, x1 - window[1].start, y1 - window[0].start
        unlike, climb = np.full(shape, UNKNOWN, np.float32), np.full(shape, UNKNOWN, np.float32)
        _measure(photo[window], colors, distance[window], *ends_in_window, radius, unlike, climb, touched)
    return window, touched


def _span(low: float, high: float, size: int) -> slice:
    first, last = (int(min(max(at, 0), size)) for at in (floor(low), ceil(high) + 1))
    return slice(first, last)


@kernel
def _contour(photo, y, x, other_y, other_x, noise):
    """Difference in colour between two pixels beyond texture."""
    total = 0.0
    for c in range(3):
        total += (photo[y, x, c] - photo[other_y, other_x, c]) ** 2
    # Root of the summed squares, in sRGB-encoded values as CONTOUR_CONTRAST is.
    return max(sqrt(total) - noise, 0.0)


@kernel
def falloff(distance):
    """How much a brush does at a distance (1 = its radius), or at many: 1 in its middle, smoothly to 0."""
    inside = np.float32(1.0) - np.minimum(distance, np.float32(1.0)) ** 2
    return inside * inside


@kernel
def _move(values, under, distance, touched, amount):
    """Lay a stroke that moves by an amount on what was there before."""
    for y in range(touched.shape[0]):
        for x in range(touched.shape[1]):
            if touched[y, x] == 0:
                continue
            # In float64, which does not overflow.
            values[y, x] = min(max(under[y, x] + falloff(distance[y, x]) * amount, -MOST), MOST)


@kernel
def _blend(values, under, target, distance, touched, strength):
    """Lay a stroke that leads to a target on what was there before."""
    for y in range(touched.shape[0]):
        for x in range(touched.shape[1]):
            if touched[y, x] == 0:
                continue
            before = np.float64(under[y, x])
            change = strength * (np.float64(target[y, x]) - before)
            values[y, x] = min(max(before + falloff(distance[y, x]) * change, -MOST), MOST)


@kernel
def _measure(photo, colors, distance, x0, y0, x1, y1, radius, unlike, climb, touched):
    """Shortest ways (8 neighbours) from the way from (x0, y0) to (x1, y1); to a pixel of a more unlike colour the way
    is longer. touched: becomes 1 where a distance became less.
    """
    height, width = distance.shape
    # A ring of pixels whose distance became less, for their neighbours (Moore 1957): each waits at most once.
    waiting = np.empty(height * width, np.int32)
    is_waiting = np.zeros(height * width, np.uint8)
    first, count = 0, 0
    # Two places a pixel, so that none is stepped over.
    steps = max(ceil(2 * hypot(x1 - x0, y1 - y0)), 1)
    for k in range(steps + 1):
        x, y = x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps
        column, row = nearest_pixel(x), nearest_pixel(y)
        if 0 <= row < height and 0 <= column < width:
            # Seeds of the ways: the exact distance from the path, in radii.
            away = np.float32(hypot(column - x, row - y) / radius)
            if away < distance[row, column]:
                distance[row, column], touched[row, column] = away, 1
                if is_waiting[row * width + column] == 0:
                    waiting[count], is_waiting[row * width + column] = row * width + column, 1
                    count += 1
    visits = MOST_VISITS * height * width
    while count > 0 and visits > 0:
        at = waiting[first]
        first = first + 1 if first + 1 < height * width else 0
        count -= 1
        visits -= 1
        is_waiting[at] = 0
        y, x = at // width, at % width
        here = distance[y, x]
        # A step leads no nearer than this, and what is at hand may be out of reach.
        if here + 1.0 / radius >= 1.0:
            continue
        top, bottom, left, right = max(y - 1, 0), min(y + 2, height), max(x - 1, 0), min(x + 2, width)
        # What lies around is looked at when the way comes there, once.
        for j in range(top, bottom):
            for i in range(left, right):
                if climb[j, i] >= 0.0 or (here >= distance[j, i] and (j != y or i != x)):
                    continue
                count_unlike = 0
                for m in range(max(j - 1, 0), min(j + 2, height)):
                    for n in range(max(i - 1, 0), min(i + 2, width)):
                        if unlike[m, n] < 0.0:
                            # The nearest of the touched colours; without any, all colours are alike.
                            red, green, blue = photo[m, n, 0], photo[m, n, 1], photo[m, n, 2]
                            least = FAR if colors.shape[1] else np.float32(0.0)
                            for c in range(colors.shape[1]):
                                total = (red - colors[0, c]) ** 2 + (green - colors[1, c]) ** 2
                                total += (blue - colors[2, c]) ** 2
                                least = min(least, total)
                                if least <= ALIKE:
                                    break  # nearer ones make no difference
                            # Squares are compared, one root a pixel is taken.
                            unlike[m, n] = max(sqrt(least) - LIKENESS, 0.0)
                        count_unlike += unlike[m, n] > 0.0
                # What few of a pixel's neighbours share is no other surface.
                climb[j, i] = unlike[j, i] if count_unlike > SPECK_PIXELS else 0.0
        own = climb[y, x]
        for j in range(top, bottom):
            for i in range(left, right):
                length = sqrt(2.0) if j != y and i != x else 1.0
                before = here + length / radius
                if not before < distance[j, i]:
                    continue
                # A step, and the climb to a less alike colour; to come back to an alike one is free.
                before += max(climb[j, i] - own, 0.0) / CONTOUR_CONTRAST
                if np.float32(before) < distance[j, i]:
                    distance[j, i], touched[j, i] = np.float32(before), 1
                    if is_waiting[j * width + i] == 0:
                        end = first + count
                        waiting[end if end < height * width else end - height * width] = j * width + i
                        is_waiting[j * width + i] = 1
                        count += 1


@kernel
def _measure_steps(photo, parting, noise, steps):
    """How far every pixel counts as being from the one at its left; steps: (H, W)."""
    for y in range(photo.shape[0]):
        for x in range(1, photo.shape[1]):
            # The domain transform: a step of one pixel, longer by what the colours differ.
            steps[y, x] = 1.0 + parting * _contour(photo, y, x, y, x - 1, noise)


@kernel
def _smooth_rows(values, steps, rate):
    """Every row of values, smoothed there and back. rate: by how much a pixel's step lets go of what was before."""
    height, width = values.shape
    kept = np.empty(width)
    for y in range(height):
        # There: a decaying mean of what lies left; across a contour (a large step) next to nothing of it is kept.
        for x in range(1, width):
            kept[x] = exp(-rate * steps[y, x])
            values[y, x] = kept[x] * values[y, x - 1] + (1.0 - kept[x]) * values[y, x]
        # And back with the same weights, so that the filter leans to no side.
        for x in range(width - 2, -1, -1):
            values[y, x] = kept[x + 1] * values[y, x + 1] + (1.0 - kept[x + 1]) * values[y, x]
