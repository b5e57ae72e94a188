"""Ambiguous rays: those of which the closed form leaves open which surface they show.

Either it covers them in part, or by several surfaces whose shares nothing tells, or a soft edge of the map lies near:
then it is sure of a surface that may be the wrong one. Of all others it is right, and T has no say.

For each of them K hypotheses are laid out: surfaces that land within a few pixels, as different from each other as
possible. A hypothesis says "this ray shows the source ray that disparity d leads to". Nothing is described or decided
here: what is found is as little as will do to ask T later.
"""

from __future__ import annotations

from itertools import product
from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.coherent_cells import land_marked
from iibr_core.rendering.disparity_statistics import SOFT
from iibr_core.rendering.ray_cells import CELL_PX
from iibr_core.rendering.ray_set import OWN_SURFACE_PX, RayArrays, RaySet
from iibr_core.rendering.resampling import ShownRays
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.types import FloatImage, ViewOffset

HYPOTHESES = 6
"""K: the paper's 5 surfaces and the plain look-up. More take time and gain little (docs/speed.md)."""
PLAIN = 128
"""Added to the source of the hypothesis that the ray shows the front-most surface as the photo mixed it at its edge."""
LEAST_WEIGHT = 0.02
RINGS_PX = (1, 2, 3, 4, 6)
"""How far around a ray surfaces are looked for: this is enough to meet every one that is not a sliver."""
SHARP_RINGS = 3
"""Where depth edges are not SOFT, only the first so many of RINGS_PX are looked at."""
REACH_PX = RINGS_PX[-1]
"""Surfaces that land within this many pixels, each way, are considered."""
BESIDE = ((0, 1), (0, -1), (1, 0), (-1, 0)), tuple(product((1, -1), repeat=2))
"""Down and right: the four places of every other ring."""
AROUND = np.array([(ring * v, ring * u) for i, ring in enumerate(RINGS_PX) for v, u in BESIDE[i % 2]])
AROUND_DISTANCE = np.hypot(*AROUND.T)
AMBIGUOUS_AROUND_PX = 1.5
"""Near a soft edge a surface that lands near by makes a ray ambiguous if its parallax differs by this."""
OWN_LANDING_PX = 0.75
"""What lands near by and differs from a hypothesis by less parallax than this is of its surface."""
VISIBLE = 0.08
"""Where the colours of a ray's hypotheses lie no farther apart than this, sRGB-encoded, nothing is to be decided."""
INPAINTED_APART_PX = 100.0
"""What is inpainted and what the photo shows are different hypotheses, however close their disparities."""


class UndecidedRays(NamedTuple):
    """Ambiguous rays (N) of one view before T is asked, as small as they can wait for it.

    hypotheses: K. pixel (N): index into the images' pixels, row by row. number (N): hypotheses of each, at most K.
    uncovered (N): share of the ray that nothing covers. disparity, source, share, nearest: of all hypotheses, those of
    one ray after those of the other; share is the closed form's weight, nearest how many pixels away its surface lands.
    """

    offset: ViewOffset
    hypotheses: int
    pixel: NDArray[np.int32]
    number: NDArray[np.uint8]
    uncovered: FloatImage
    disparity: FloatImage
    source: NDArray[np.uint8]
    share: FloatImage
    nearest: FloatImage

    @property
    def nbytes(self) -> int:
        """Memory they take."""
        return sum(part.nbytes for part in self if isinstance(part, np.ndarray))


class _Landed(NamedTuple):
    """What a view shows in some rows. to_view (S, 2): from each source. looks: so many of AROUND are looked at."""

    rays: RayArrays
    to_view: NDArray[np.float64]
    candidates: Candidates
    weights: FloatImage
    shown: ShownRays
    parallax: float
    looks: int


class _Hypotheses(NamedTuple):
    """`UndecidedRays` with room for all hypotheses: (N, K), and (N) for number and uncovered."""

    number: NDArray[np.uint8]
    uncovered: FloatImage
    disparity: FloatImage
    source: NDArray[np.uint8]
    share: FloatImage
    nearest: FloatImage


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
    """The ambiguous rays in rows [first, last) of these candidates, which should reach REACH_PX rows beyond them, but
    for those already decided (N, W).

    shown: what `resampling.heaviest_candidate` gives. every: take all rays near which anything lands, ambiguous or not.
    hypotheses: K. Raises ValueError for fewer than two: a surface and the plain look-up.
    """
    if hypotheses < 2:
        raise ValueError(f"{hypotheses} hypotheses a ray: give 2 at least")
    offset, first_row, (height, width) = candidates.offset, candidates.first_row, candidates.number.shape
    around, to_view = rays.statistics, rays.to_view(offset)
    is_soft = around.softness > SOFT
    looks = len(AROUND) if is_soft else len(BESIDE[0]) * SHARP_RINGS
    landed = _Landed(rays.arrays, to_view, candidates, weights, shown, max(*map(abs, offset), 1e-9), looks)
    near_soft = land_marked(rays.cells, to_view, rays.soft_cells, (first_row, first_row + height), REACH_PX)
    if decided is None:
        decided = np.zeros((height, width), np.bool_)
    pixel = np.empty(((rows[1] - rows[0]) * width, 2), np.int64)
    selected = _select_rays(landed, around.soft, is_soft, near_soft, decided, rows, every, pixel)
    pixel, shape = pixel[:selected], (selected, hypotheses)
    floats = (np.empty(shape, np.float32) for _ in range(3))
    uncovered, source = np.empty(selected, np.float32), np.empty(shape, np.uint8)
    disparity, share, nearest = floats
    found = _Hypotheses(np.empty(selected, np.uint8), uncovered, disparity, source, share, nearest)
    _lay_out(landed, pixel, every, found)
    is_open, used = found.number > 0, np.arange(hypotheses) < found.number[:, None]
    y, x = pixel[is_open].T
    return UndecidedRays(
        offset, hypotheses, np.asarray((first_row + y) * width + x, np.int32), found.number[is_open],
        uncovered[is_open], disparity[used], source[used], share[used], nearest[used],
    )  # fmt: skip


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
def _is_open(number, source, weights, photo_images, y, x):
    """Whether the closed form leaves open what a ray shows: it covers the ray in part, or by several surfaces of which
    none is a fringe: a fringe tells the shares.
    """
    heavy, fringed, covered = 0, False, 0.0
    for k in range(np.int64(number[y, x])):
        covered += weights[k, y, x]
        if weights[k, y, x] > LEAST_WEIGHT:
            heavy += 1
            fringed |= 0 < source[k, y, x] < photo_images
    return covered < 1.0 - LEAST_WEIGHT or (heavy != 1 and not fringed)


@kernel
def _select_rays(landed, soft, is_soft, near_soft, decided, selected_rows, every, pixel):
    """Write the (row, column) of the ambiguous rays to pixel; returns how many they are. In smooth cells there are none
    but where soft edges are near.
    """
    candidates, weights, offsets = landed.candidates, landed.weights, landed.to_view
    number, smooth, first_row = candidates.number, candidates.smooth, candidates.first_row
    shown_disparity, shown_source, photo_images = landed.shown.disparity, landed.shown.source, landed.rays.photo_images
    rows, width = number.shape
    least_apart = AMBIGUOUS_AROUND_PX / landed.parallax
    found = 0
    for y in range(*selected_rows):
        # Band rows count from first_row, cells from the picture's first row.
        cell_row = (y + first_row % CELL_PX) // CELL_PX
        for cell in range(smooth.shape[1]):
            is_near_soft = near_soft[cell_row, cell]
            if smooth[cell_row, cell] and not every and not is_near_soft:
                continue
            for x in range(cell * CELL_PX, min((cell + 1) * CELL_PX, width)):
                if decided[y, x]:
                    continue
                # Most rays: one surface that covers them.
                is_ambiguous = every or (
                    (number[y, x] != 1 or weights[0, y, x] < 1.0 - LEAST_WEIGHT)
                    and _is_open(number, candidates.source, weights, photo_images, y, x)
                )
                if not is_ambiguous and is_near_soft:
                    # Another surface shows near by, and a soft edge lies between.
                    d, image = shown_disparity[y, x], np.int64(shown_source[y, x])
                    is_soft_here = _is_near_soft_edge(soft, is_soft, d, image, x, first_row + y, offsets, photo_images)
                    for i in range(landed.looks):
                        v, u = y + AROUND[i, 0], x + AROUND[i, 1]
                        if not (0 <= v < rows and 0 <= u < width and number[v, u] > 0):
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
def _surfaces_around(landed, y, x, near_disparity, near_source, near_px):
    """What shows around a ray, the nearest first; returns how many that are."""
    number, first_row, offsets = landed.candidates.number, landed.candidates.first_row, landed.to_view
    (rows, width), height = number.shape, landed.rays.disparity.shape[1]
    n = 0
    for i in range(landed.looks):
        v, u = y + AROUND[i, 0], x + AROUND[i, 1]
        if not (0 <= v < rows and 0 <= u < width and number[v, u] > 0):
            continue
        d, image = landed.shown.disparity[v, u], np.int64(landed.shown.source[v, u])
        source_x, source_y = x + d * offsets[image, 1], first_row + y + d * offsets[image, 0]
        is_inside = -0.5 <= source_x <= width - 0.5 and -0.5 <= source_y <= height - 0.5
        if is_inside or image >= landed.rays.photo_images:  # the photo shows nothing beyond its frame
            near_disparity[n], near_source[n], near_px[n] = d, image, AROUND_DISTANCE[i]
            n += 1
    return n


@kernel
def _pick_apart(near_disparity, near_source, n, photo_images, parallax, disparity, source, share, picked):
    """Farthest-point sampling of the disparities around a ray, until slots or distinct ones run out, one slot staying
    free; returns how many are picked. In a hole it begins with the front-most surface around it.
    """
    if picked == 0 and n > 0:
        front = np.argmax(near_disparity[:n])
        disparity[0], source[0], share[0] = near_disparity[front], near_source[front], 0.0
        picked = 1
    # How far what is near lies from what is picked.
    away = np.full(len(AROUND), np.inf)
    compared = 0
    while 0 < picked < len(disparity) - 1:
        for j in range(compared, picked):
            d, is_guess = np.float64(disparity[j]), source[j] >= photo_images
            for i in range(n):
                between = INPAINTED_APART_PX if (near_source[i] >= photo_images) != is_guess else 0.0
                away[i] = min(away[i], abs(near_disparity[i] - d) * parallax + between)
        best, best_distance = -1, OWN_SURFACE_PX
        for i in range(n):
            if away[i] > best_distance:
                best, best_distance = i, away[i]
        if best < 0:
            break
        compared = picked
        disparity[picked], source[picked], share[picked] = near_disparity[best], near_source[best], 0.0
        picked += 1
    return picked


@kernel
def _lay_out(landed, pixel, every, found):
    """The surfaces on each ray of pixel, then those around it; the plain hypothesis comes last. number: 0 of rays that
    leave nothing to be decided. nearest: how many pixels away each lands.
    """
    candidates, weights, parallax = landed.candidates, landed.weights, landed.parallax
    near_d, near_k, near_px = np.empty(len(AROUND)), np.empty(len(AROUND), np.int64), np.empty(len(AROUND))
    for ray in range(len(pixel)):
        y, x = pixel[ray, 0], pixel[ray, 1]
        disparity, source, share = found.disparity[ray], found.source[ray], found.share[ray]
        # First the surfaces on the ray itself. One slot stays free for the plain hypothesis.
        picked, mixed, left = 0, 0, 1.0
        for k in range(np.int64(candidates.number[y, x])):
            left -= weights[k, y, x]
            if weights[k, y, x] > LEAST_WEIGHT and picked < len(disparity) - 1:
                disparity[picked], source[picked] = candidates.disparity[k, y, x], candidates.source[k, y, x]
                share[picked] = weights[k, y, x]
                mixed = picked if disparity[picked] > disparity[mixed] else mixed
                picked += 1
        found.uncovered[ray] = max(left, 0.0)
        n = _surfaces_around(landed, y, x, near_d, near_k, near_px)
        picked = _pick_apart(near_d, near_k, n, landed.rays.photo_images, parallax, disparity, source, share, picked)
        found.number[ray] = 0
        if picked == 0 or not (every or _is_undecided(landed, y, x, disparity[:picked], source)):
            continue
        # The plain hypothesis: the front-most surface on the ray, colours as the photo mixed them at its edge.
        disparity[picked], source[picked], share[picked] = disparity[mixed], source[mixed] + PLAIN, 0.0
        found.number[ray] = picked + 1
        # How near each surface lands: 0 on the ray itself, else by the first landing like it.
        for j in range(picked + 1):
            found.nearest[ray, j] = 0.0 if share[j] > 0 else REACH_PX + 1.0
            if share[j] > 0:
                continue
            for i in range(n):
                if abs(near_d[i] - disparity[j]) * parallax < OWN_LANDING_PX:
                    found.nearest[ray, j] = near_px[i]
                    break


@kernel
def _is_undecided(landed, y, x, disparity, source):
    """Whether a ray's surfaces are not all one, and the colours that they look up, the four pixels around each, differ
    visibly.
    """
    images, offsets = landed.rays.colors, landed.to_view
    _, height, width, _ = images.shape
    apart = 0.0
    low_r = low_g = low_b = np.float32(np.inf)
    high_r = high_g = high_b = np.float32(-np.inf)
    for j in range(len(disparity)):
        d, k = disparity[j], np.uint64(source[j])
        apart = max(apart, abs(d - disparity[0]) * landed.parallax)
        column = floor(x + d * offsets[k, 1])
        row = floor(landed.candidates.first_row + y + d * offsets[k, 0])
        for i in range(4):
            u = np.uint64(min(max(column + i % 2, 0), width - 1))
            v = np.uint64(min(max(row + i // 2, 0), height - 1))
            r, g, b = images[k, v, u, 0], images[k, v, u, 1], images[k, v, u, 2]
            low_r, low_g, low_b = min(low_r, r), min(low_g, g), min(low_b, b)
            high_r, high_g, high_b = max(high_r, r), max(high_g, g), max(high_b, b)
    return apart > OWN_SURFACE_PX and max(high_r - low_r, high_g - low_g, high_b - low_b) > VISIBLE
