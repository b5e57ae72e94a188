"""Fills occluded rays with what may lie behind: continued surfaces that the photo could not see there.

A surface continued into a hole is possible only where something nearer hid it from the photo, or where it left the
frame; else the photo would have shown it. That one test rules out the foreground beside a disocclusion, and at the
frame's border it picks the surface that really leaves the frame, without any threshold on depth.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.protocol import Inpainter
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.runtime.tiling import ShouldStop, in_bands, in_pieces, never, raise_if_stopped
from iibr_core.types import FloatImage, ViewOffset, image_size

DIRECTIONS = np.array(
    [
        (1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1),
        (2, 1), (-2, 1), (2, -1), (-2, -1), (1, 2), (-1, 2), (1, -2), (-1, -2),
    ]
)  # fmt: skip
SMOOTH_PX = 2
MOST_PIECE_PIXELS = 1 << 15
"""Hole pixels that are filled between two questions whether to stop."""
HIDDEN_PX = 0.5
"""Something hides a surface if it lands at least this far from it."""


def fill_background(
    colors: FloatImage,
    disparity: FloatImage,
    hole: NDArray[np.bool_],
    photo_disparity: FloatImage,
    offset: ViewOffset,
    should_stop: ShouldStop = never,
    threads: int = 1,
) -> None:
    """Fill the holes of a view in place: colors (H, W, 3), disparity (H, W) where hole (H, W) is True.

    photo_disparity: the centre view's. Every hole pixel is a mean of the nearest known pixels in sixteen directions
    that are possible there, weighted by 1 / distance, then smoothed within its surface. A view that is all hole stays
    as it is. Raises Cancelled once should_stop is true.
    """
    pixels = _hole_pixels(hole, should_stop, threads)
    known = _nearest_known(hole, pixels, should_stop, threads)
    smoothed = np.empty((len(pixels), 3), np.float32)
    tolerance = HIDDEN_PX / max(abs(offset.s), abs(offset.t))
    steps: tuple[Callable[[slice], None], ...] = (
        lambda part: _fill(colors, disparity, pixels[part], known[part], photo_disparity, offset.s, offset.t),
        lambda part: _smooth(colors, disparity, hole, pixels[part], tolerance, smoothed[part]),
        # Written back only now: a pixel's neighbours are smoothed from what was filled, not from what was smoothed.
        lambda part: _write_colors(smoothed[part], pixels[part], colors),
    )
    parts = [slice(first, first + MOST_PIECE_PIXELS) for first in range(0, len(pixels), MOST_PIECE_PIXELS)]
    for step in steps:
        in_pieces(step, parts, should_stop, threads)


def background_inpainter() -> Inpainter:
    """For the registry: nothing to load."""
    return fill_background


def _hole_pixels(hole: NDArray[np.bool_], should_stop: ShouldStop, threads: int) -> NDArray[np.int64]:
    """Flat indices (N,) of the hole pixels, ascending."""
    size = image_size(hole)

    def band(first: int, last: int) -> NDArray[np.int64]:
        return first * size.width + np.flatnonzero(hole[first:last])

    return np.concatenate(in_bands(band, size, should_stop, threads))


def _nearest_known(
    hole: NDArray[np.bool_], pixels: NDArray[np.int64], should_stop: ShouldStop, threads: int
) -> NDArray[np.int64]:
    """Flat indices (N, 16) of the known pixels around each hole pixel (N), one a direction, -1 if there is none.

    The second known pixel where there are two (the first may be mixed with what hides the hole).
    """
    raise_if_stopped(should_stop)
    number = np.empty(hole.shape, np.int32)
    _number(pixels, number)
    known = np.empty((len(pixels), len(DIRECTIONS)), np.int64)

    def look(k: int) -> None:
        _nearest_known_towards(hole, pixels, number, *DIRECTIONS[k], known[:, k])

    in_pieces(look, range(len(DIRECTIONS)), should_stop, threads)
    return known


@kernel
def _number(pixels, number):
    """Tell each hole pixel which one it is."""
    width = number.shape[1]
    for i in range(len(pixels)):
        number[pixels[i] // width, pixels[i] % width] = i


@kernel
def _nearest_known_towards(hole, pixels, number, step_x, step_y, known):
    """What `_nearest_known` returns, for one direction.

    pixels: flat indices of the hole pixels, ascending. Holes pass on what the next pixel in that direction found, so
    the cost does not depend on the holes' size.
    """
    height, width = hole.shape
    total = len(pixels)
    # In the order in which the next pixel in that direction, if a hole, comes first.
    downwards = step_y < 0 or (step_y == 0 and step_x < 0)
    for n in range(total):
        i = n if downwards else total - 1 - n
        # The neighbour: off the frame, a hole that passes on what it found, or known.
        y, x = pixels[i] // width + step_y, pixels[i] % width + step_x
        known[i] = -1
        if not (0 <= x < width and 0 <= y < height):
            continue
        if hole[y, x]:
            known[i] = known[number[y, x]]
            continue
        # One farther if that is known too: the first may be mixed with what hides the hole.
        beyond_x, beyond_y = x + step_x, y + step_y
        if 0 <= beyond_x < width and 0 <= beyond_y < height and not hole[beyond_y, beyond_x]:
            x, y = beyond_x, beyond_y
        known[i] = y * width + x


@kernel
def _fill(colors, disparity, pixels, known, photo_disparity, s, t):
    height, width = disparity.shape
    directions = known.shape[1]
    possible = np.empty(directions, np.bool_)
    parallax = max(abs(s), abs(t))
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        farthest = np.inf
        any_possible = False
        # Which of the surfaces around may continue to here: where each would lie in the photo (backward warp), ...
        for k in range(directions):
            possible[k] = False
            if known[i, k] < 0:
                continue
            d = disparity[known[i, k] // width, known[i, k] % width]
            farthest = min(farthest, d)
            # ... something nearer must hide it by HIDDEN_PX, or it must be off the frame.
            column, row = nearest_pixel(x + d * s), nearest_pixel(y + d * t)
            inside = 0 <= column < width and 0 <= row < height
            possible[k] = not inside or (photo_disparity[row, column] - d) * parallax > HIDDEN_PX
            any_possible = any_possible or possible[k]
        # Their mean, weighted by 1 / distance.
        total = r = g = b = sum_d = 0.0
        for k in range(directions):
            if known[i, k] < 0:
                continue
            known_y, known_x = known[i, k] // width, known[i, k] % width
            d = disparity[known_y, known_x]
            # Where nothing is possible (the disparity contradicts itself), the farthest is the likeliest.
            if not (possible[k] or (not any_possible and d <= farthest)):
                continue
            w = 1.0 / np.sqrt((known_x - x) ** 2 + (known_y - y) ** 2)
            total += w
            r += w * colors[known_y, known_x, 0]
            g += w * colors[known_y, known_x, 1]
            b += w * colors[known_y, known_x, 2]
            sum_d += w * d
        if total > 0:
            colors[y, x, 0], colors[y, x, 1], colors[y, x, 2] = r / total, g / total, b / total
            disparity[y, x] = sum_d / total


@kernel
def _smooth(colors, disparity, hole, pixels, tolerance, smoothed):
    """Average what was filled over SMOOTH_PX each way on the same surface: neighbours took their colours from afar."""
    height, width = disparity.shape
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        count = r = g = b = 0.0
        # A box mean over the hole's pixels of one surface: known pixels stay sharp, and do not bleed in.
        for v in range(max(y - SMOOTH_PX, 0), min(y + SMOOTH_PX + 1, height)):
            for u in range(max(x - SMOOTH_PX, 0), min(x + SMOOTH_PX + 1, width)):
                if hole[v, u] and abs(disparity[v, u] - disparity[y, x]) <= tolerance:
                    count += 1.0
                    r += colors[v, u, 0]
                    g += colors[v, u, 1]
                    b += colors[v, u, 2]
        smoothed[i, 0], smoothed[i, 1], smoothed[i, 2] = r / count, g / count, b / count


@kernel
def _write_colors(smoothed, pixels, colors):
    width = colors.shape[1]
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        colors[y, x, 0], colors[y, x, 1], colors[y, x, 2] = smoothed[i, 0], smoothed[i, 1], smoothed[i, 2]
