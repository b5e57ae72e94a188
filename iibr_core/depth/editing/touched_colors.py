"""The colours that a stroke touched, and which pixels are unlike all of them."""

from __future__ import annotations

from math import ceil, floor, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import Stroke
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ImageSize

LIKENESS = 0.08
"""Colours so near to one that the stroke touched are the same surface."""
TOUCH_RADII = 0.15
"""Colours so near to its path are touched, ..."""
TOUCH_POINTS = 8
"""... for so many of its points: then it may have come to another surface."""
COLOR_BIN = 0.1
MOST_TOUCHED = 4000

GUIDE_STEPS = 1024
"""Of a guide's integers from black to white: processors compare many integers at once, floats one by one."""
DARKEST, BRIGHTEST = -2.0, 20.0
"""Of HDR: squares of the differences fit 32 bits."""

CUBE_BITS = 4
"""So many bits of a guide's integers are left out to find out once for a cube of colours whether all are alike."""
CUBE_HALF = 2 ** (CUBE_BITS - 1)
CUBES_ACROSS = (GUIDE_STEPS >> CUBE_BITS) + 1
CUBES = CUBES_ACROSS**3
UNSEEN, ALIKE, UNLIKE, MIXED = np.uint8(0), np.uint8(1), np.uint8(2), np.uint8(3)
LIKE_SQUARE = int((LIKENESS * GUIDE_STEPS) ** 2)
"""Squared, in `GUIDE_STEPS`; and of the middle of a cube whose colours are all alike, or all unlike."""
CUBE_ALIKE_SQUARE = int((LIKENESS * GUIDE_STEPS - sqrt(3) * CUBE_HALF) ** 2) - 1
CUBE_UNLIKE_SQUARE = int((LIKENESS * GUIDE_STEPS + sqrt(3) * CUBE_HALF) ** 2) + 1

Guide = NDArray[np.int16]
"""(H + 2, W + 2, 3): a photo in `GUIDE_STEPS`, with a border of one pixel that nothing reads for its colour."""
Colors = NDArray[np.int32]
"""(3, N), in `GUIDE_STEPS`."""


def guide_of(photo: FloatImage) -> Guide:
    """The photo (H, W, 3), sRGB-encoded, as strokes are measured on it."""
    height, width = photo.shape[:2]
    guide = np.zeros((height + 2, width + 2, 3), np.int16)
    finite = np.nan_to_num(photo, nan=0.0, posinf=BRIGHTEST, neginf=DARKEST)
    guide[1:-1, 1:-1] = np.rint(np.clip(finite, DARKEST, BRIGHTEST) * np.float32(GUIDE_STEPS))
    return guide


def stroke_colours(guide: Guide, stroke: Stroke, index: int) -> Colors:
    """Colours (3, N) that a stroke touched on its way to the point of this index; a few that stand for all."""
    size = ImageSize(guide.shape[0] - 2, guide.shape[1] - 2)
    reach = max(TOUCH_RADII * stroke.radius_px(size.width), 1.0)
    parts = []
    for x, y in stroke.points[max(index - TOUCH_POINTS + 1, 0) : index + 1]:
        rows = pixel_span((y * size.height - 0.5,), reach, size.height)
        columns = pixel_span((x * size.width - 0.5,), reach, size.width)
        parts.append(guide[1:-1, 1:-1][rows, columns].reshape(-1, 3))
    colors = np.concatenate(parts)
    colors = colors[:: max(1, len(colors) // MOST_TOUCHED)].astype(np.int64)
    across = int((BRIGHTEST - DARKEST) / COLOR_BIN) + 1
    bins = (colors - int(DARKEST * GUIDE_STEPS)) // int(COLOR_BIN * GUIDE_STEPS) @ (across**2, across, 1)
    _, bins, counts = np.unique(bins, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(bins, colors[:, channel], len(counts)) for channel in range(3)])
    means: Colors = np.rint(sums / counts).astype(np.int32)
    return means


def pixel_span(places: tuple[float, ...], reach: float, size: int) -> slice:
    """Pixels from so far before the first of the places to so far after the last, as far as there are any."""
    first, last = (int(min(max(at, 0), size)) for at in (floor(min(places) - reach), ceil(max(places) + reach) + 1))
    return slice(first, last)


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
def mark_unlike(guide, colors, cubes, y, start, stop, is_unlike):
    """Set 1 where the pixels [start, stop) of a row have `unlikeness`, else 0. guide, is_unlike: with a border.

    cubes: (`CUBES`,) uint8, at first `UNSEEN`: what is known of colours, kept for the next rows.
    """
    # A loop of its own, which takes several pixels at a time.
    cube_of = np.empty(guide.shape[1], np.int32)
    for x in range(start, stop):
        red, green, blue = np.int32(guide[y, x, 0]), np.int32(guide[y, x, 1]), np.int32(guide[y, x, 2])
        is_within = (min(red, min(green, blue)) >= 0) & (max(red, max(green, blue)) <= GUIDE_STEPS)
        cube = ((red >> CUBE_BITS) * CUBES_ACROSS + (green >> CUBE_BITS)) * CUBES_ACROSS + (blue >> CUBE_BITS)
        cube_of[x] = cube if is_within else -1
    for x in range(start, stop):
        kind = cubes[cube_of[x]] if cube_of[x] >= 0 else MIXED
        while kind in (UNSEEN, MIXED):
            red, green, blue = np.int32(guide[y, x, 0]), np.int32(guide[y, x, 1]), np.int32(guide[y, x, 2])
            near, far = LIKE_SQUARE, LIKE_SQUARE
            if kind == UNSEEN:
                # The middle of the cube tells of all its colours, unless it is near the limit.
                red, green, blue = (
                    (red >> CUBE_BITS << CUBE_BITS) + CUBE_HALF,
                    (green >> CUBE_BITS << CUBE_BITS) + CUBE_HALF,
                    (blue >> CUBE_BITS << CUBE_BITS) + CUBE_HALF,
                )
                near, far = CUBE_ALIKE_SQUARE, CUBE_UNLIKE_SQUARE
            least = np.int32(2**31 - 1) if colors.shape[1] else np.int32(0)
            for c in range(colors.shape[1]):
                total = (red - colors[0, c]) ** 2 + (green - colors[1, c]) ** 2 + (blue - colors[2, c]) ** 2
                least = min(least, np.int32(total))
            found = ALIKE if least <= near else UNLIKE if least > far else MIXED
            if kind == UNSEEN:
                cubes[cube_of[x]] = found
            kind = found
        is_unlike[y, x] = kind == UNLIKE
