"""Ambiguous rays: those of which the closed form leaves open which surface they show.

Either it covers them in part, or by several surfaces whose shares nothing tells. Of all others T has no say, near soft
edges neither: there its say gains less than 0.01 dB on fresh drawn scenes.

For each of them K hypotheses are laid out: surfaces that land within a few pixels, as different from each other as
possible. A hypothesis says "this ray shows the source ray that disparity d leads to". Nothing is described or decided
here: what is found is as little as will do to ask T later.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.laid_hypotheses import (
    FAINT_WEIGHT,
    Hypotheses,
    Landed,
    lay_out,
)
from iibr_core.rendering.ray_cells import CELL_PX
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.resampling import ShownRays
from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage, ViewOffset

HYPOTHESES = 6
"""K: the paper's 5 surfaces and the plain look-up. More take time and gain little (docs/speed.md)."""


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
    landed = Landed(rays.arrays, rays.to_view(offset), candidates, weights, shown, max(*map(abs, offset), 1e-9))
    if decided is None:
        decided = np.zeros((height, width), np.bool_)
    pixel = np.empty(((rows[1] - rows[0]) * width, 2), np.int64)
    selected = _select_rays(landed, decided, rows, every, pixel)
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
                # Most rays: one surface that covers them.
                is_sole = number[y, x] == 1 and weights[0, y, x] >= 1.0 - FAINT_WEIGHT
                if decided[y, x] or (is_sole and not every):
                    continue
                if every or _is_open(number, candidates.source, weights, photo_images, y, x):
                    pixel[found, 0], pixel[found, 1] = y, x
                    found += 1
    return found
