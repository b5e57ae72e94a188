"""Finds the ambiguous rays of a view, and the surfaces that each of them may show.

Nothing is described or decided here: what is found is as little as will do to ask the transformer later.
"""

from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.ambiguity import AMBIGUOUS_AROUND_PX, SOFT
from iibr_core.rendering.ambiguous_rays import HYPOTHESES, LEAST_WEIGHT, PLAIN, REACH_PX, UndecidedRays
from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.coherent_cells import land_marked
from iibr_core.rendering.ray_set import CELL_PX, RaySet
from iibr_core.rendering.resampling import ShownRays
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.types import FloatImage

AROUND = np.array(
    [
        (0, 1), (0, -1), (1, 0), (-1, 0), (2, 2), (2, -2), (-2, 2), (-2, -2), (0, 3), (0, -3), (3, 0), (-3, 0),
        (4, 4), (4, -4), (-4, 4), (-4, -4), (0, 6), (0, -6), (6, 0), (-6, 0),
    ]
)  # fmt: skip
"""Where, in pixels down and right, the nearest first: this is enough to meet every surface that is not a sliver."""
AROUND_DISTANCE = np.hypot(*AROUND.T)
AROUND_SHARP = 12
"""Where depth edges are not SOFT, only the first so many of AROUND are looked at."""
OWN_LANDING_PX = 0.75
"""What lands near by and differs from a hypothesis by less parallax than this is of its surface."""
DISTINCT_PX = 0.5
"""Hypotheses closer than this are one; where all of a ray's are, nothing is to be decided."""
VISIBLE = 0.08
"""Where the colours of a ray's hypotheses lie no farther apart than this, sRGB-encoded, nothing is to be decided."""
INPAINTED_APART_PX = 100.0
"""What is inpainted and what the photo shows are different hypotheses, however close their disparities."""


def find_undecided_rays(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    shown: ShownRays,
    rows: tuple[int, int],
    every: bool = False,
    hypotheses: int = HYPOTHESES,
    decided: NDArray[np.bool_] | None = None,
) -> UndecidedRays:
    """The rays of `find_ambiguous_rays`, but for those already decided (N, W), and as little as will do to describe
    them later.

    Raises ValueError for fewer than two hypotheses: a surface and the plain look-up.
    """
    if hypotheses < 2:
        raise ValueError(f"{hypotheses} hypotheses a ray: give 2 at least")
    from_sources = rays.to_view(candidates.offset)
    around = rays.statistics
    parallax = max(*map(abs, candidates.offset), 1e-9)
    is_soft = around.softness > SOFT
    looks = len(AROUND) if is_soft else AROUND_SHARP
    in_band = candidates.first_row, candidates.first_row + len(candidates.number)
    near_soft = land_marked(rays.cells, from_sources, rays.soft_cells, in_band, REACH_PX)
    pixel = np.empty(((rows[1] - rows[0]) * candidates.number.shape[1], 2), np.int64)
    if decided is None:
        decided = np.zeros(candidates.number.shape, np.bool_)
    selected = _select_rays(
        candidates.smooth & (not every), near_soft, decided, candidates.number, candidates.source, weights, *shown[1:],
        around.soft, is_soft, from_sources, rays.photo_images, parallax, looks, candidates.first_row, *rows, every,
        pixel,
    )  # fmt: skip
    shape = selected, hypotheses
    number = np.empty(selected, np.int64)
    disparity, source = np.empty(shape, np.float32), np.empty(shape, np.uint8)
    share, nearest = np.empty(shape, np.float32), np.empty(shape, np.float32)
    found = pixel[:selected], number, disparity, source, share, nearest
    _collect_hypotheses(
        candidates.number, candidates.disparity, candidates.source, weights, *shown[1:], rays.size.height, from_sources,
        rays.photo_images, parallax, looks, candidates.first_row, *found,
    )  # fmt: skip
    open_rays = _drop_decided(rays.arrays.colors, from_sources, parallax, candidates.first_row, every, *found)
    packed = _pack(candidates.number, weights, candidates.first_row, *(part[:open_rays] for part in found))
    return UndecidedRays(candidates.offset, hypotheses, *packed)


@kernel
def _is_near_soft_edge(soft, is_soft, d, image, x, y, offsets, photo_images):
    """Whether the source ray that shows at (x, y) lies near a soft edge; is_soft: what inpainted ones take for that."""
    if image >= photo_images:
        return is_soft
    height, width = soft.shape
    u = min(max(nearest_pixel(x + d * offsets[image, 1]), 0), width - 1)
    v = min(max(nearest_pixel(y + d * offsets[image, 0]), 0), height - 1)
    return soft[v, u]


@kernel
def _is_open(count, source, weights, photo_images, y, x):
    """Whether the closed form leaves open what a ray shows: it covers the ray in part, or by several surfaces of which
    none is a fringe: a fringe tells the shares.
    """
    used = np.int64(count[y, x])
    heavy, fringed, covered = 0, False, 0.0
    for k in range(used):
        covered += weights[k, y, x]
        if weights[k, y, x] > LEAST_WEIGHT:
            heavy += 1
            fringed |= 0 < source[k, y, x] < photo_images
    return covered < 1.0 - LEAST_WEIGHT or (heavy != 1 and not fringed)


@kernel
def _select_rays(
    smooth, near_soft, decided, count, candidate_source, weights, shown_disparity, shown_source, soft, is_soft, offsets,
    photo_images, parallax, looks, first_row, first, last, every, pixel,
):  # fmt: skip
    """Write the (row, column) of the ambiguous rays to pixel; returns how many they are. In smooth cells there are none
    but where soft edges are near.
    """
    rows, width = count.shape
    least_apart = AMBIGUOUS_AROUND_PX / parallax
    found = 0
    for y in range(first, last):
        # Band rows count from first_row, cells from the picture's first row.
        cell_row = (y + first_row % CELL_PX) // CELL_PX
        for cell in range(smooth.shape[1]):
            is_near_soft = near_soft[cell_row, cell]
            if smooth[cell_row, cell] and not is_near_soft:
                continue
            for x in range(cell * CELL_PX, min((cell + 1) * CELL_PX, width)):
                if decided[y, x]:
                    continue
                # Most rays: one surface that covers them.
                is_ambiguous = every or (
                    (count[y, x] != 1 or weights[0, y, x] < 1.0 - LEAST_WEIGHT)
                    and _is_open(count, candidate_source, weights, photo_images, y, x)
                )
                if not is_ambiguous and is_near_soft:
                    # Another surface shows near by, and a soft edge lies between.
                    d, image = shown_disparity[y, x], np.int64(shown_source[y, x])
                    is_soft_here = _is_near_soft_edge(soft, is_soft, d, image, x, first_row + y, offsets, photo_images)
                    for i in range(looks):
                        v, u = y + AROUND[i, 0], x + AROUND[i, 1]
                        if not (0 <= v < rows and 0 <= u < width and count[v, u] > 0):
                            continue
                        other, image = shown_disparity[v, u], np.int64(shown_source[v, u])
                        if abs(other - d) > least_apart and (
                            is_soft_here
                            or _is_near_soft_edge(soft, is_soft, other, image, u, first_row + v, offsets, photo_images)
                        ):
                            is_ambiguous = True
                            break
                if is_ambiguous:
                    pixel[found, 0], pixel[found, 1] = y, x
                    found += 1
    return found


@kernel
def _surfaces_around(
    y, x, count, shown_disparity, shown_source, height, offsets, photo_images, looks, first_row,
    near_disparity, near_source, near_px,
):  # fmt: skip
    """What shows around a ray, the nearest first; returns how many that are."""
    rows, width = count.shape
    n = 0
    for i in range(looks):
        v, u = y + AROUND[i, 0], x + AROUND[i, 1]
        if not (0 <= v < rows and 0 <= u < width and count[v, u] > 0):
            continue
        d, image = shown_disparity[v, u], np.int64(shown_source[v, u])
        source_x, source_y = x + d * offsets[image, 1], first_row + y + d * offsets[image, 0]
        is_inside = -0.5 <= source_x <= width - 0.5 and -0.5 <= source_y <= height - 0.5
        if is_inside or image >= photo_images:  # the photo shows nothing beyond its frame
            near_disparity[n], near_source[n], near_px[n] = d, image, AROUND_DISTANCE[i]
            n += 1
    return n


@kernel
def _collect_hypotheses(
    count, surface, origin, weights, shown_disparity, shown_source, height, offsets, photo_images, parallax,
    looks, first_row, pixel, number, disparity, source, share, nearest,
):  # fmt: skip
    """Pick the surfaces on each ray of pixel, then again and again the one around it farthest
    from those; the plain hypothesis comes last. nearest: how many pixels away each lands.
    """
    near_d, near_k, near_px = np.empty(len(AROUND)), np.empty(len(AROUND), np.int64), np.empty(len(AROUND))
    away = np.empty(len(AROUND))
    for ray in range(len(pixel)):
        y, x = pixel[ray, 0], pixel[ray, 1]
        # First the surfaces on the ray itself. One slot stays free for the plain hypothesis.
        picked = mixed = 0
        for k in range(np.int64(count[y, x])):
            if weights[k, y, x] > LEAST_WEIGHT and picked < disparity.shape[1] - 1:
                disparity[ray, picked], source[ray, picked] = surface[k, y, x], origin[k, y, x]
                share[ray, picked] = weights[k, y, x]
                mixed = picked if disparity[ray, picked] > disparity[ray, mixed] else mixed
                picked += 1
        n = _surfaces_around(
            y, x, count, shown_disparity, shown_source, height, offsets, photo_images, looks, first_row,
            near_d, near_k, near_px,
        )  # fmt: skip
        # In a hole: begin with the front-most surface around it.
        if picked == 0 and n > 0:
            front = np.argmax(near_d[:n])
            disparity[ray, 0], source[ray, 0], share[ray, 0] = near_d[front], near_k[front], 0.0
            picked = 1
        # Farthest-point sampling of the disparities around it, until slots or distinct ones run out. away: how far what
        # is near lies from what is picked.
        compared = 0
        away[:n] = np.inf
        while 0 < picked < disparity.shape[1] - 1:
            for j in range(compared, picked):
                d, is_guess = np.float64(disparity[ray, j]), source[ray, j] >= photo_images
                for i in range(n):
                    between = INPAINTED_APART_PX if (near_k[i] >= photo_images) != is_guess else 0.0
                    away[i] = min(away[i], abs(near_d[i] - d) * parallax + between)
            best, best_distance = -1, DISTINCT_PX
            for i in range(n):
                if away[i] > best_distance:
                    best, best_distance = i, away[i]
            if best < 0:
                break
            compared = picked
            disparity[ray, picked], source[ray, picked], share[ray, picked] = near_d[best], near_k[best], 0.0
            picked += 1
        # The plain hypothesis: the front-most surface on the ray, colours as the photo mixed them at its edge.
        if picked > 0:
            disparity[ray, picked], source[ray, picked] = disparity[ray, mixed], source[ray, mixed] + PLAIN
            share[ray, picked] = 0.0
            picked += 1
        number[ray] = picked
        # How near each surface lands: 0 on the ray itself, else by the first landing like it.
        for j in range(picked):
            nearest[ray, j] = 0.0 if share[ray, j] > 0 else REACH_PX + 1.0
            if share[ray, j] > 0:
                continue
            for i in range(n):
                if abs(near_d[i] - disparity[ray, j]) * parallax < OWN_LANDING_PX:
                    nearest[ray, j] = near_px[i]
                    break


@kernel
def _contrast(images, offsets, x, y, ray, picked, disparity, source):
    """How far the colours that a ray's hypotheses look up lie apart at most: those of the four pixels around each."""
    _, height, width, _ = images.shape
    low_r = low_g = low_b = np.float32(np.inf)
    high_r = high_g = high_b = np.float32(-np.inf)
    for j in range(picked):
        d, k = disparity[ray, j], np.uint64(source[ray, j])
        column, row = floor(x + d * offsets[k, 1]), floor(y + d * offsets[k, 0])
        for i in range(4):
            u = np.uint64(min(max(column + i % 2, 0), width - 1))
            v = np.uint64(min(max(row + i // 2, 0), height - 1))
            r, g, b = images[k, v, u, 0], images[k, v, u, 1], images[k, v, u, 2]
            low_r, low_g, low_b = min(low_r, r), min(low_g, g), min(low_b, b)
            high_r, high_g, high_b = max(high_r, r), max(high_g, g), max(high_b, b)
    return max(high_r - low_r, high_g - low_g, high_b - low_b)


@kernel
def _drop_decided(images, offsets, parallax, first_row, every, pixel, number, disparity, source, share, nearest):
    """Rays with something to decide move up; returns how many they are."""
    found = 0
    for ray in range(len(pixel)):
        y, x = pixel[ray, 0], pixel[ray, 1]
        # All hypotheses but the plain one, which is a second look at one of them.
        picked = number[ray] - 1
        if picked < 1:
            continue
        apart = 0.0
        for j in range(picked):
            apart = max(apart, abs(disparity[ray, j] - disparity[ray, 0]) * parallax)
        is_open = apart > DISTINCT_PX and (
            every or _contrast(images, offsets, x, first_row + y, ray, picked, disparity, source) > VISIBLE
        )
        if every or is_open:
            pixel[found, 0], pixel[found, 1], number[found] = y, x, number[ray]
            disparity[found], source[found] = disparity[ray], source[ray]
            share[found], nearest[found] = share[ray], nearest[ray]
            found += 1
    return found


@kernel
def _pack(count, weights, first_row, pixel, number, disparity, source, share, nearest):
    """The arrays of `UndecidedRays`, in their order."""
    rays, hypotheses, width = len(pixel), number.sum(), count.shape[1]
    index, used = np.empty(rays, np.int32), np.empty(rays, np.uint8)
    uncovered = np.empty(rays, np.float32)
    surfaces, images = np.empty(hypotheses, np.float32), np.empty(hypotheses, np.uint8)
    shares, distances = np.empty(hypotheses, np.float32), np.empty(hypotheses, np.float32)
    at = 0
    for n in range(rays):
        y, x = pixel[n]
        left = 1.0
        for slot in range(np.int64(count[y, x])):
            left -= weights[slot, y, x]
        index[n], used[n], uncovered[n] = (first_row + y) * width + x, number[n], max(left, 0.0)
        for a in range(number[n]):
            surfaces[at], images[at] = disparity[n, a], source[n, a]
            shares[at], distances[at] = share[n, a], nearest[n, a]
            at += 1
    return index, used, uncovered, surfaces, images, shares, distances
