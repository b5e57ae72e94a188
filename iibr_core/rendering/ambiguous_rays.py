"""Ambiguous rays: those of which the closed form leaves open which surface they show.

Either it covers them in part, or by several surfaces whose shares nothing tells, or a soft edge of the map lies near:
then it is sure of a surface that may be the wrong one. Of all others it is right, and T has no say.

For each of them K hypotheses are laid out: surfaces that land within a few pixels, as different from each other as
possible. A hypothesis says "this ray shows the source ray that disparity d leads to". Nothing is described or decided
here: what is found is as little as will do to ask T later.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.coherent_cells import land_marked
from iibr_core.rendering.disparity_statistics import SOFT_EDGE_SHARPNESS
from iibr_core.rendering.laid_hypotheses import (
    AROUND,
    BESIDE,
    FAINT_WEIGHT,
    SEARCH_PX,
    SHARP_RINGS,
    Hypotheses,
    Landed,
    lay_out,
)
from iibr_core.rendering.ray_cells import CELL_PX
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.resampling import ShownRays
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.types import FloatImage, ViewOffset

HYPOTHESES = 6
"""K: the paper's 5 surfaces and the plain look-up. More take time and gain little (docs/speed.md)."""
AMBIGUOUS_AROUND_PX = 1.5
"""Near a soft edge a surface that lands near by makes a ray ambiguous if its parallax differs by this."""


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
    around, to_view = rays.statistics, rays.to_view(offset)
    is_soft = around.softness > SOFT_EDGE_SHARPNESS
    looks = len(AROUND) if is_soft else len(BESIDE[0]) * SHARP_RINGS
    landed = Landed(rays.arrays, to_view, candidates, weights, shown, max(*map(abs, offset), 1e-9), looks)
    near_soft = land_marked(rays.cells, to_view, rays.soft_cells, (first_row, first_row + height), SEARCH_PX)
    if decided is None:
        decided = np.zeros((height, width), np.bool_)
    pixel = np.empty(((rows[1] - rows[0]) * width, 2), np.int64)
    selected = _select_rays(landed, around.soft, is_soft, near_soft, decided, rows, every, pixel)
    pixel, shape = pixel[:selected], (selected, hypotheses)
    floats = (np.empty(shape, np.float32) for _ in range(3))
    uncovered, source = np.empty(selected, np.float32), np.empty(shape, np.uint8)
    disparity, share, nearest = floats
    found = Hypotheses(np.empty(selected, np.uint8), uncovered, disparity, source, share, nearest)
    lay_out(landed, pixel, every, found)
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
        if weights[k, y, x] > FAINT_WEIGHT:
            heavy += 1
            fringed |= 0 < source[k, y, x] < photo_images
    return covered < 1.0 - FAINT_WEIGHT or (heavy != 1 and not fringed)


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
                    (number[y, x] != 1 or weights[0, y, x] < 1.0 - FAINT_WEIGHT)
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
