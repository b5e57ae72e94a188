"""Fills occluded rays with what may lie behind: continued surfaces that the photo could not see there.

A surface continued into a hole is possible only where something nearer hid it from the photo, or where it left the
frame; else the photo would have shown it. That one test rules out the foreground beside a disocclusion, and at the
frame's border it picks the surface that really leaves the frame, without any threshold on depth.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.nearest_known import MAX_HOLE_PIXELS_AT_ONCE, nearest_known, number_pixels
from iibr_core.inpainting.patch_synthesis import copy_patches
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.runtime.tiling import in_pieces, pieces_of
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX, is_in_front, same_surface, step_of
from iibr_core.types import FloatImage, ViewOffset

MEDIAN_PX = 2
"""Distance, in pixels, of the filled disparities whose median counts: outliers would be displaced in the next view."""
WIDE_PX = 2.0
"""Distance from known pixels from which on, and within 2 px of which, holes get texture, in pixels."""
SMOOTH_STEPS_PX = (1, 2, 4, 8, 16, 32)
"""Distances, in pixels, over which colours are averaged one after the other, up to that of the nearest known pixel."""


def fill_background(
    colors: FloatImage,
    disparity: FloatImage,
    hole: NDArray[np.bool_],
    photo_disparity: FloatImage,
    offset: ViewOffset,
    threads: int = 1,
    stages: Stages = ALL_STAGES,
    farthest_views: float | None = None,
) -> None:
    """Fill the holes of a view in place: colors (H, W, 3), disparity (H, W) where hole (H, W) is True.

    The nearest known pixels in sixteen directions are considered. Those whose surface may continue to the hole are
    weighted by 1 / distance; if none may, the farthest counts. The colour is their mean, smoother the farther away they
    are, plus their surface's fine texture. The disparity is that of one surface, the one with the most weight (a mean
    of several would lie on none), and then the median of the disparities around. A view that is all hole stays.
    photo_disparity: the centre view's, which hides what lies behind it; -inf hides nothing. stages: the ones that are
    on. farthest_views: distance in view steps at which pixels of one surface move apart by at most EDGE_PX, that of
    the offset by default.
    """
    one_surface = step_of(EDGE_PX, farthest_views or max(map(abs, offset)))
    pixels, number, known = nearest_known(hole, threads)
    reach, medians = (np.empty(len(pixels), np.float32) for _ in range(2))
    changed = np.empty((len(pixels), 3), np.float32)

    def run(step: Callable[[slice], None]) -> None:
        in_pieces(step, pieces_of(len(pixels), MAX_HOLE_PIXELS_AT_ONCE), threads)

    def fill(part: slice) -> None:
        at = pixels[part], known[part], reach[part]
        _fill(colors, disparity, *at, photo_disparity, offset, one_surface)

    def smooth(step_px: int, part: slice) -> None:
        _smooth(colors, hole, pixels[part], reach[part], step_px, changed[part])

    run(fill)
    run(lambda part: _medians(disparity, hole, pixels[part], medians[part]))
    np.put(disparity, pixels, medians)
    for step_px in SMOOTH_STEPS_PX:
        run(partial(smooth, step_px))
        # Written after the whole step, because the means take the neighbours' colours before it.
        colors.reshape(-1, 3)[pixels] = changed
    if stages.synthesise_patches:
        # Slivers, as behind pixels that are covered in part, show no texture.
        wide = np.zeros_like(hole)
        _mark_wide(hole, pixels, reach, wide)
        pixels = np.flatnonzero(wide)
        number_pixels(pixels, number)
        copy_patches(colors, disparity, wide, pixels, number, one_surface, threads)


def continues_in_front(
    disparity: FloatImage,
    hole: NDArray[np.bool_],
    photo_disparity: FloatImage,
    offset: ViewOffset,
    threads: int = 1,
) -> NDArray[np.bool_]:
    """Return where in a hole (H, W) most surfaces that may continue there are in front of its disparity (H, W)."""
    pixels, _, known = nearest_known(hole, threads)
    in_front, one_surface = np.zeros_like(hole), step_of(EDGE_PX, max(map(abs, offset)))

    def weigh(part: slice) -> None:
        _weigh_in_front(disparity, pixels[part], known[part], photo_disparity, offset, one_surface, in_front)

    in_pieces(weigh, pieces_of(len(pixels), MAX_HOLE_PIXELS_AT_ONCE), threads)
    return in_front


@kernel
def _weigh_surfaces(disparity, pixel, known, photo_disparity, offset, one_surface, surface, weight):
    """Write the disparity of the nearest known pixels around a pixel, and their weight, 1 / distance: 0 without one,
    negative if its surface cannot continue to this pixel.

    It can only where something nearer hides it from the photo, or outside the photo's frame.
    """
    (height, width), (t, s) = disparity.shape, offset
    y, x = pixel // width, pixel % width
    for k in range(len(known)):
        weight[k] = 0.0
        if known[k] < 0:
            continue
        known_y, known_x = known[k] // width, known[k] % width
        surface[k] = d = disparity[known_y, known_x]
        weight[k] = 1.0 / np.sqrt((known_x - x) ** 2 + (known_y - y) ** 2)
        v, u = nearest_pixel(y + d * t), nearest_pixel(x + d * s)
        is_inside = 0 <= u < width and 0 <= v < height
        if is_inside and not is_in_front(photo_disparity[v, u], d, one_surface * (SAME_SURFACE_PX / EDGE_PX)):
            weight[k] = -weight[k]


@kernel
def _fill(colors, disparity, pixels, known, reach, photo_disparity, offset, one_surface):
    """Fill pixels (N,), flat indices, from the nearest known pixels (N, 16), see `fill_background`.

    reach (N,): gets the distance of the nearest of these, inf without any.
    """
    width, directions = disparity.shape[1], known.shape[1]
    surface, weight = np.zeros(directions), np.zeros(directions)
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        _weigh_surfaces(disparity, pixels[i], known[i], photo_disparity, offset, one_surface, surface, weight)
        farthest, reach[i] = np.inf, np.inf
        for k in range(directions):
            if weight[k] != 0:
                farthest, reach[i] = min(farthest, surface[k]), min(reach[i], 1.0 / abs(weight[k]))
        # If no surface can continue (the disparity contradicts itself), the farthest is the likeliest.
        any_possible = weight.max() > 0
        for k in range(directions):
            is_farthest = not any_possible and surface[k] <= farthest
            weight[k] = abs(weight[k]) if is_farthest else max(weight[k], 0.0)
        chosen, most = _heaviest(surface, weight, one_surface)
        if chosen < 0:
            continue
        total = r = g = b = sum_d = 0.0
        for k in range(directions):
            w = weight[k]
            if not w > 0:
                continue
            known_y, known_x = known[i, k] // width, known[i, k] % width
            total += w
            r += w * colors[known_y, known_x, 0]
            g += w * colors[known_y, known_x, 1]
            b += w * colors[known_y, known_x, 2]
            if same_surface(surface[k], surface[chosen], one_surface):
                sum_d += w * surface[k]
        colors[y, x, 0], colors[y, x, 1], colors[y, x, 2] = r / total, g / total, b / total
        disparity[y, x] = sum_d / most


@kernel
def _heaviest(surface, weight, one_surface):
    """Return the index of the surface with the most weight (the farther of equals, -1 without any), and its weight."""
    chosen, most = -1, 0.0
    for k in range(len(surface)):
        votes = 0.0
        if weight[k] > 0:
            for j in range(len(surface)):
                if same_surface(surface[j], surface[k], one_surface):
                    votes += weight[j]
        if votes > most or (votes > 0 and votes == most and surface[k] < surface[chosen]):
            chosen, most = k, votes
    return chosen, most


@kernel
def _weigh_in_front(disparity, pixels, known, photo_disparity, offset, one_surface, in_front):
    """Write `continues_in_front` to in_front (H, W) for pixels (N,) from the nearest known pixels (N, 16)."""
    surface, weight = np.zeros(known.shape[1]), np.zeros(known.shape[1])
    for i in range(len(pixels)):
        y, x = pixels[i] // disparity.shape[1], pixels[i] % disparity.shape[1]
        _weigh_surfaces(disparity, pixels[i], known[i], photo_disparity, offset, one_surface, surface, weight)
        balance = 0.0
        for k in range(len(weight)):
            likely = max(weight[k], 0.0)
            balance += likely if is_in_front(surface[k], disparity[y, x], one_surface) else -likely
        in_front[y, x] = balance > 0.0


@kernel
def _medians(disparity, hole, pixels, medians):
    """Write the medians (N,) of the filled disparities within MEDIAN_PX of pixels (N,)."""
    height, width = disparity.shape
    around = np.empty((2 * MEDIAN_PX + 1) ** 2, np.float32)
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        count = 0
        for v in range(max(y - MEDIAN_PX, 0), min(y + MEDIAN_PX + 1, height)):
            for u in range(max(x - MEDIAN_PX, 0), min(x + MEDIAN_PX + 1, width)):
                if hole[v, u]:
                    around[count] = disparity[v, u]
                    count += 1
        medians[i] = np.sort(around[:count])[(count - 1) // 2]


@kernel
def _smooth(colors, hole, pixels, reach, step, smoothed):
    """Write the means (N, 3) over hole pixels `step` apart, for pixels at least as far from known ones.

    Pixels beside known ones stay sharp, and no streaks lead from there into wide holes.
    """
    height, width = hole.shape
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        smoothed[i] = colors[y, x]
        if reach[i] < step:
            continue
        # Weights 1 2 1 along each axis (the a-trous scheme: the next step doubles the distances).
        total = r = g = b = 0.0
        for v in range(y - step, y + step + 1, step):
            for u in range(x - step, x + step + 1, step):
                if 0 <= v < height and 0 <= u < width and hole[v, u]:
                    w = (1.0 + (v == y)) * (1.0 + (u == x))
                    total += w
                    r += w * colors[v, u, 0]
                    g += w * colors[v, u, 1]
                    b += w * colors[v, u, 2]
        smoothed[i, 0], smoothed[i, 1], smoothed[i, 2] = r / total, g / total, b / total


@kernel
def _mark_wide(hole, pixels, reach, wide):
    """Mark in wide (H, W) the hole pixels near those that lie WIDE_PX or more from known ones."""
    height, width = hole.shape
    for i in range(len(pixels)):
        if reach[i] >= WIDE_PX:
            y, x = pixels[i] // width, pixels[i] % width
            for v in range(max(y - 2, 0), min(y + 3, height)):
                for u in range(max(x - 2, 0), min(x + 3, width)):
                    wide[v, u] |= hole[v, u]
