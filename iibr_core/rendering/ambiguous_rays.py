"""Ambiguous rays: those of which the closed form leaves open which surface they show.

Either it covers them in part, or by several surfaces whose shares nothing tells. Of all others T has no say.

For each of them K hypotheses are laid out: the surfaces on it, then those that land within a few pixels, as different
from each other as possible, last the plain look-up. A hypothesis says "this ray shows the source ray that disparity d
leads to". Nothing is described or decided here: what is found is as little as will do to ask T later.
"""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.ray_cells import CELL_PX
from iibr_core.rendering.ray_set import RayArrays, RaySet
from iibr_core.rendering.resampling import ShownRays
from iibr_core.runtime.kernels import kernel
from iibr_core.surfaces import SAME_SURFACE_PX
from iibr_core.types import FloatImage, ViewOffset

HYPOTHESES = 6
"""K: the paper's 5 surfaces and the plain look-up. More take time and gain little (docs/speed.md)."""
PLAIN_SOURCE = 128
"""Added to the source of the hypothesis that the ray shows the front-most surface as the photo mixed it at its edge."""
FAINT_WEIGHT = 0.02
SEARCH_PX = 3
"""Surfaces that land within so many pixels, each way, are considered: twice as many would gain 0.002 dB at most."""
BESIDE, DIAGONAL = np.array([(0, 1), (0, -1), (1, 0), (-1, 0)]), np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
AROUND = np.concatenate([BESIDE, 2 * DIAGONAL, 3 * BESIDE])
"""Down and right: where they are looked for."""
AROUND_DISTANCE = np.hypot(*AROUND.T)
NOWHERE_PX = 7.0
"""How far away a surface counts as landing that lands nowhere around: as the transformer was trained."""
LEAST_STAKE = 0.05
"""Nothing is to be decided where what the heaviest surface leaves of a ray, times how far the colours of its hypotheses
lie apart, sRGB-encoded, is no more than this.
"""


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
    """What a view shows in some rows. to_view (S, 2): from each source."""

    rays: RayArrays
    to_view: NDArray[np.float64]
    candidates: Candidates
    weights: FloatImage
    shown: ShownRays
    parallax: float


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
    """The ambiguous rays in rows [first, last) of these candidates, which should reach SEARCH_PX rows beyond them, but
    for those already decided (N, W).

    shown: what `resampling.heaviest_candidate` gives. every: take all rays near which anything lands, ambiguous or not.
    hypotheses: K. Raises ValueError for fewer than two: a surface and the plain look-up.
    """
    if hypotheses < 2:
        raise ValueError(f"{hypotheses} hypotheses a ray: give 2 at least")
    offset, first_row, (height, width) = candidates.offset, candidates.first_row, candidates.number.shape
    landed = _Landed(rays.arrays, rays.to_view(offset), candidates, weights, shown, max(*map(abs, offset), 1e-9))
    if decided is None:
        decided = np.zeros((height, width), np.bool_)
    pixel = np.empty(((rows[1] - rows[0]) * width, 2), np.int64)
    selected = _select_rays(landed, decided, rows, every, pixel)
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
def _is_open(number, source, weights, photo_images, y, x):
    """Whether the closed form leaves open what a ray shows: it covers the ray in part, or by several surfaces of which
    none is a fringe, as a fringe tells the shares; and the heaviest leaves enough of the ray.
    """
    heaviest, covered, fringed = 0.0, 0.0, False
    for k in range(np.int64(number[y, x])):
        covered += weights[k, y, x]
        heaviest = max(heaviest, weights[k, y, x])
        fringed |= weights[k, y, x] > FAINT_WEIGHT and 0 < source[k, y, x] < photo_images
    return 1.0 - heaviest > LEAST_STAKE and (covered < 1.0 - FAINT_WEIGHT or not fringed)


@kernel
def _select_rays(landed, decided, selected_rows, every, pixel):
    """Write the (row, column) of the ambiguous rays to pixel; returns how many they are. In smooth cells there are
    none.
    """
    candidates, weights, photo_images = landed.candidates, landed.weights, landed.rays.photo_images
    number, smooth, first_row = candidates.number, candidates.smooth, candidates.first_row
    width = number.shape[1]
    found = 0
    for y in range(*selected_rows):
        # Band rows count from first_row, cells from the picture's first row.
        cell_row = (y + first_row % CELL_PX) // CELL_PX
        for cell in range(smooth.shape[1]):
            if smooth[cell_row, cell] and not every:
                continue
            for x in range(cell * CELL_PX, min((cell + 1) * CELL_PX, width)):
                is_open = every or _is_open(number, candidates.source, weights, photo_images, y, x)
                if is_open and not decided[y, x]:
                    pixel[found, 0], pixel[found, 1] = y, x
                    found += 1
    return found


@kernel
def _surfaces_around(landed, y, x, near_disparity, near_source, near_px):
    """What shows around a ray, the nearest first; returns how many that are."""
    number, first_row, offsets = landed.candidates.number, landed.candidates.first_row, landed.to_view
    (rows, width), height = number.shape, landed.rays.disparity.shape[1]
    n = 0
    for i in range(len(AROUND)):
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
def _pick_apart(near_disparity, near_source, n, parallax, disparity, source, share, picked):
    """Farthest-point sampling of the disparities around a ray, until slots or distinct ones run out, one slot staying
    free; returns how many are picked. In a hole it begins with the front-most surface around it.
    """
    if picked == 0 and n > 0:
        foreground = np.argmax(near_disparity[:n])
        disparity[0], source[0], share[0] = near_disparity[foreground], near_source[foreground], 0.0
        picked = 1
    # How far what is near lies from what is picked.
    away = np.full(len(AROUND), np.inf)
    compared = 0
    while 0 < picked < len(disparity) - 1:
        for j in range(compared, picked):
            d = np.float64(disparity[j])
            for i in range(n):
                away[i] = min(away[i], abs(near_disparity[i] - d) * parallax)
        best, best_distance = -1, SAME_SURFACE_PX
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
            if weights[k, y, x] > FAINT_WEIGHT and picked < len(disparity) - 1:
                disparity[picked], source[picked] = candidates.disparity[k, y, x], candidates.source[k, y, x]
                share[picked] = weights[k, y, x]
                mixed = picked if disparity[picked] > disparity[mixed] else mixed
                picked += 1
        found.uncovered[ray] = max(left, 0.0)
        n = _surfaces_around(landed, y, x, near_d, near_k, near_px)
        picked = _pick_apart(near_d, near_k, n, parallax, disparity, source, share, picked)
        found.number[ray] = 0
        if picked == 0 or not (every or _is_undecided(landed, y, x, disparity[:picked], source, share)):
            continue
        # The plain hypothesis: the front-most surface on the ray, colours as the photo mixed them at its edge.
        disparity[picked], source[picked], share[picked] = disparity[mixed], source[mixed] + PLAIN_SOURCE, 0.0
        found.number[ray] = picked + 1
        # How near each surface lands: 0 on the ray itself, else by the first landing like it.
        for j in range(picked + 1):
            found.nearest[ray, j] = 0.0 if share[j] > 0 else NOWHERE_PX
            if share[j] > 0:
                continue
            for i in range(n):
                if abs(near_d[i] - disparity[j]) * parallax < SAME_SURFACE_PX:
                    found.nearest[ray, j] = near_px[i]
                    break


@kernel
def _is_undecided(landed, y, x, disparity, source, share):
    """Whether a ray's surfaces are not all one, and what the heaviest leaves of it may change its colour visibly: see
    LEAST_STAKE. Looked at are the four pixels around where each looks its colour up.
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
    left = 1.0 - share[: len(disparity)].max()
    may_change = left * max(high_r - low_r, high_g - low_g, high_b - low_b)
    return apart > SAME_SURFACE_PX and may_change > LEAST_STAKE
