"""Gives what `background` continues into the holes the texture of what lies around, behind, never of what is in front.

PatchMatch (Barnes et al., SIGGRAPH 2009) finds for the patch around every hole pixel the most similar one that the view
shows whole; a pixel takes the middle of its own: a mean of all patches over it would be as smooth as what it replaces.
Of what that changes only the fine part is kept: texture can be told from what lies around, the place of large things
cannot.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.nearest_known import number_pixels
from iibr_core.inpainting.protocol import Inpainter
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands, in_pieces, never, pieces_of
from iibr_core.types import FloatImage, ViewOffset, image_size

RADIUS_PX = 3
"""Patches are 7 x 7 pixels."""
SHIFTS = (1, 2, 3)
"""The greatest of 2, then of 4, then of 7 pixels in a row."""
SEARCHES = 6
"""So often every pixel asks its neighbours for a better patch: fewer leave noise, for neighbours do not agree yet."""
SEARCH_PX = 32
"""Patches are looked for so far away, then at halves of it around the best."""
IN_FRONT_PX = 2.0
"""What is nearer than the hole's surface by more than this is in front of it."""
HOLE_WEIGHT = np.float32(0.5)
"""Of pixels that were filled, when patches are compared; known ones count 1."""
MOST_PIECE_PIXELS = 1 << 12
"""Pixels between two questions whether to stop."""


def fill_patches(
    colors: FloatImage,
    disparity: FloatImage,
    hole: NDArray[np.bool_],
    photo_disparity: FloatImage,
    offset: ViewOffset,
    should_stop: ShouldStop = never,
    threads: int = 1,
) -> None:
    """Fill the holes of a view in place, as `Inpainter` says: disparity is that of `fill_background`.

    Holes around which no patch is whole stay as that fills them. Raises Cancelled once should_stop is true.
    """
    fill_background(colors, disparity, hole, photo_disparity, offset, should_stop, threads)
    in_front = np.float32(IN_FRONT_PX / max(abs(offset.s), abs(offset.t)))
    targets, number = _targets(disparity, hole, in_front, should_stop)
    nearest = np.empty(hole.shape, np.float32)
    in_bands(
        lambda first, last: _nearest_of_patches(disparity, hole, first, last, nearest),
        image_size(hole), should_stop, threads,
    )  # fmt: skip
    starts = range(0, len(targets), MOST_PIECE_PIXELS)
    parts = [(first, min(first + MOST_PIECE_PIXELS, len(targets))) for first in starts]
    match, cost = np.full((len(targets), 2), -1, np.int32), np.empty(len(targets), np.float32)
    for step in range(SEARCHES):
        before = match.copy()

        def search(part: tuple[int, int], step: int = step, before: NDArray[np.int32] = before) -> None:
            _search(colors, disparity, hole, nearest, in_front, number, targets, *part, step, before, match, cost)

        in_pieces(search, parts, should_stop, threads)
    change, tempered = np.empty((len(targets), 3), np.float32), np.empty((len(targets), 3), np.float32)
    steps: tuple[Callable[[tuple[int, int]], None], ...] = (
        lambda part: _change(colors, hole, targets, match, *part, change),
        lambda part: _temper(hole, number, targets, change, *part, tempered),
        lambda part: _apply(hole, targets, tempered, *part, colors),
    )
    for each in steps:
        in_pieces(each, parts, should_stop, threads)


def patch_inpainter() -> Inpainter:
    """For the registry: nothing to load."""
    return fill_patches


def _targets(
    disparity: FloatImage, hole: NDArray[np.bool_], in_front: np.float32, should_stop: ShouldStop
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Pixels whose patches are looked for, holes and what is known of their surfaces beside them: flat indices (N,),
    ascending, and their numbers (H, W), -1 for others. Cracks too thin to show texture are left out.
    """
    wanted, pixels = np.zeros_like(hole), np.flatnonzero(hole)
    parts = [pixels[part] for part in pieces_of(len(pixels), MOST_PIECE_PIXELS)]
    in_pieces(lambda part: _add_surroundings(disparity, hole, in_front, part, wanted), parts, should_stop)
    targets = np.flatnonzero(wanted)
    number = np.empty(hole.shape, np.int32)
    number_pixels(targets, number)
    return targets, number


@kernel
def _add_surroundings(disparity, hole, in_front, pixels, wanted):
    """Of hole pixels whose neighbours are holes, or off the frame."""
    height, width = hole.shape
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        is_wide = hole[max(y - 1, 0), x] and hole[min(y + 1, height - 1), x]
        if not (is_wide and hole[y, max(x - 1, 0)] and hole[y, min(x + 1, width - 1)]):
            continue
        for v in range(max(y - RADIUS_PX, 0), min(y + RADIUS_PX + 1, height)):
            for u in range(max(x - RADIUS_PX, 0), min(x + RADIUS_PX + 1, width)):
                wanted[v, u] |= hole[v, u] or abs(disparity[v, u] - disparity[y, x]) <= in_front


def _nearest_of_patches(
    disparity: FloatImage, hole: NDArray[np.bool_], first: int, last: int, nearest: FloatImage
) -> None:
    """Of rows [first, last): the nearest disparity in the patch around each pixel, inf where it is not known whole."""
    height, width = hole.shape
    nearest[first:last] = np.inf
    top, bottom = max(first, RADIUS_PX), min(last, height - RADIUS_PX)
    if top >= bottom or width <= 2 * RADIUS_PX:
        return
    rows = slice(top - RADIUS_PX, bottom + RADIUS_PX)
    most = np.where(hole[rows], np.float32(np.inf), disparity[rows])
    for shift in SHIFTS:
        most = np.maximum(most[:, :-shift], most[:, shift:])
    for shift in SHIFTS:
        most = np.maximum(most[:-shift], most[shift:])
    nearest[top:bottom, RADIUS_PX : width - RADIUS_PX] = most


@kernel
def _mix_bits(a, b):
    """A pseudo-random number of 64 bits (a finaliser in the manner of MurmurHash3)."""
    bits = (np.uint64(a) * np.uint64(0x9E3779B97F4A7C15)) ^ (np.uint64(b) * np.uint64(0xC2B2AE3D27D4EB4F))
    bits ^= bits >> np.uint64(29)
    bits *= np.uint64(0xBF58476D1CE4E5B9)
    return bits ^ (bits >> np.uint64(32))


@kernel
def _search(
    colors, disparity, hole, nearest, in_front, number, targets, first, last, step, before, match, cost,
):  # fmt: skip
    """One step of PatchMatch for targets [first, last): what was found before, what that of the neighbours implies, and
    random places ever closer to the best. Neighbours say what they had before the step, so order does not matter.
    """
    height, width = hole.shape
    side = 2 * RADIUS_PX + 1
    patch, at = np.empty((side * side, 4), np.float32), np.empty((side * side, 2), np.int64)
    for i in range(first, last):
        y, x = targets[i] // width, targets[i] % width
        here = disparity[y, x]
        # The patch to be matched, without what is in front and what is off the frame.
        taps, total = 0, np.float32(0.0)
        for v in range(max(y - RADIUS_PX, 0), min(y + RADIUS_PX + 1, height)):
            for u in range(max(x - RADIUS_PX, 0), min(x + RADIUS_PX + 1, width)):
                if disparity[v, u] > here + in_front:
                    continue
                weight = HOLE_WEIGHT if hole[v, u] else np.float32(1.0)
                for c in range(3):
                    patch[taps, c] = colors[v, u, c]
                patch[taps, 3] = weight
                at[taps, 0], at[taps, 1] = v - y, u - x
                taps, total = taps + 1, total + weight
        best_y, best_x, best = np.int64(-1), np.int64(-1), np.float32(np.inf)
        reach = SEARCH_PX
        for k in range(64):
            # Candidates: its own, its four neighbours' moved along, ...
            if k < 5:
                down, across = (k == 1) - (k == 2), (k == 3) - (k == 4)
                if not (0 <= y + down < height and 0 <= x + across < width):
                    continue
                beside = number[y + down, x + across]
                if beside < 0 or before[beside, 0] < 0:
                    continue
                source_y, source_x = np.int64(before[beside, 0]) - down, np.int64(before[beside, 1]) - across
            # ... then random ones, around the best if there is one.
            elif reach > 0:
                bits = _mix_bits(targets[i], 64 * step + k)
                span = np.uint64(2 * reach + 1)
                source_y = (best_y if best_y >= 0 else y) - reach + np.int64((bits & np.uint64(0xFFFF)) % span)
                source_x = (
                    (best_x if best_y >= 0 else x)
                    - reach
                    + np.int64(((bits >> np.uint64(16)) & np.uint64(0xFFFF)) % span)
                )
                reach //= 2
            else:
                break
            # Whole, and nothing in it in front of the surface to be filled.
            if (
                not (0 <= source_y < height and 0 <= source_x < width)
                or not nearest[source_y, source_x] <= here + in_front
            ):
                continue
            # Mean square difference, given up once it is worse than the best.
            difference, limit, tap = np.float32(0.0), best * total, 0
            while tap < taps and difference < limit:
                row, column = np.uint64(source_y + at[tap, 0]), np.uint64(source_x + at[tap, 1])
                red = colors[row, column, 0] - patch[tap, 0]
                green = colors[row, column, 1] - patch[tap, 1]
                blue = colors[row, column, 2] - patch[tap, 2]
                difference += patch[tap, 3] * (red * red + green * green + blue * blue)
                tap += 1
            if difference < limit:
                best_y, best_x, best = source_y, source_x, difference / total
        match[i, 0], match[i, 1], cost[i] = best_y, best_x, best


@kernel
def _change(colors, hole, targets, match, first, last, change):
    """How the middle of the patch that was found differs from each hole pixel, (N, 3)."""
    width = hole.shape[1]
    for i in range(first, last):
        y, x = targets[i] // width, targets[i] % width
        for c in range(3):
            is_found = hole[y, x] and match[i, 0] >= 0
            change[i, c] = colors[match[i, 0], match[i, 1], c] - colors[y, x, c] if is_found else np.float32(0.0)


@kernel
def _temper(hole, number, targets, change, first, last, tempered):
    """How a change differs from its mean over a patch's hole pixels, all (N, 3)."""
    height, width = hole.shape
    coarse = np.empty(3)
    for i in range(first, last):
        y, x = targets[i] // width, targets[i] % width
        if not hole[y, x]:
            continue
        coarse[:] = 0.0
        count = 0
        for v in range(max(y - RADIUS_PX, 0), min(y + RADIUS_PX + 1, height)):
            for u in range(max(x - RADIUS_PX, 0), min(x + RADIUS_PX + 1, width)):
                if hole[v, u] and number[v, u] >= 0:
                    count += 1
                    for c in range(3):
                        coarse[c] += change[number[v, u], c]
        for c in range(3):
            tempered[i, c] = change[i, c] - coarse[c] / count


@kernel
def _apply(hole, targets, change, first, last, colors):
    width = hole.shape[1]
    for i in range(first, last):
        y, x = targets[i] // width, targets[i] % width
        if hole[y, x]:
            for c in range(3):
                colors[y, x, c] = max(colors[y, x, c] + change[i, c], 0.0)
