"""What making a scene's views will cost, before any is made: time and memory in each quality.

Time is three measured rates, each times what there is of it: pixels of all views, those of them where surfaces part,
rays that the transformer is asked for. `python -m benchmarks.prediction` fits the rates again.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, get_args

import numpy as np

from iibr_core.generation.outer_views import outer_views_of_grid
from iibr_core.runtime.tiling import THREADS, in_bands
from iibr_core.types import FloatImage, GridShape, ImageSize, Quality, image_size

CORES = THREADS
DRAFT_BYTES = 11
"""Of a pixel of a draft: colours twice, disparity, whether it is inpainted."""
STILL_PX = 0.5
"""Less parallax than this across the whole grid cannot be seen: the scene is flat."""
SMOOTH_PX = 0.4
"""A surface whose pixels move apart by less than this is smooth: see `surfaces.SMOOTH_SHARE`."""
AMBIGUOUS_PX = 1.5
"""Where disparities move apart by more than this, surfaces meet: some rays there are ambiguous."""
OPEN_SHARE = 0.11
"""Of the rays where surfaces meet, so many are left open by the closed form."""
MOST_PARALLAX_PX = 1e6


class Workload(NamedTuple):
    """What there is to do for all views together.

    pixels: of views. rough_pixels: those of them where no smooth surface shows. rays: the transformer is asked for.
    """

    pixels: float
    rough_pixels: float
    rays: float


NANOSECONDS = Workload(45.0, 585.0, 1295.0)
"""What each takes one core."""


class CostEstimate(NamedTuple):
    """Cost of making all views: seconds on all cores of a machine like the one measured on, and bytes of all drafts."""

    seconds: float
    draft_bytes: int = 0


class CostEstimates(NamedTuple):
    """In each quality."""

    fast: CostEstimate
    balanced: CostEstimate

    def of(self, quality: Quality) -> CostEstimate:
        """Those of one quality."""
        return self.fast if quality == "fast" else self.balanced


NO_COST = CostEstimates(*2 * [CostEstimate(0.0)])


@dataclass(frozen=True, eq=False)
class ParallaxStatistics:
    """How content of a photo of a size moves in the outermost view, px. step (M, N): the largest difference between
    neighbours in each cell of CELL_PX x CELL_PX pixels. spread (M, N): from the least to the most in it and the cells
    to the right and below. most_px: of all content.
    """

    size: ImageSize
    step: FloatImage
    spread: FloatImage
    most_px: float

    @property
    def pixels(self) -> int:
        """Of a view."""
        return math.prod(self.size)

    @property
    def edge_share(self) -> float:
        """Share of the pixels near an edge where surfaces meet in the outermost view."""
        return _share_beyond(self.step, AMBIGUOUS_PX, 1.0)

    @property
    def has_disocclusion(self) -> bool:
        """Whether any view shows what the photo hides, at depth edges or beyond the frame."""
        return self.most_px > STILL_PX

    def rough_share(self, parallax: float) -> float:
        """Share of the pixels where no smooth surface shows, with so much of the outermost view's parallax."""
        return _share_beyond(self.step, SMOOTH_PX, parallax)

    def ambiguous_share(self, parallax: float) -> float:
        """Share of the rays that are ambiguous there: where surfaces meet, at a step or within some pixels."""
        return OPEN_SHARE * _share_beyond(self.spread, AMBIGUOUS_PX, parallax)


def _share_beyond(moved_px: FloatImage, least_px: float, parallax: float) -> float:
    return float((moved_px * np.float32(parallax) > least_px).mean())


def measure_parallax(disparity: FloatImage, outermost: float) -> ParallaxStatistics:
    """Of field disparity (H, W), px per view step; NaN counts as 0. outermost: the largest view offset."""
    # Kernels: numba must not load before the first plan is made, and the window's state imports this file at start.
    from iibr_core.rendering.ray_cells import CELL_PX, largest_steps

    moved = np.nan_to_num(disparity * np.float32(outermost))
    moved = np.clip(moved, -MOST_PARALLAX_PX, MOST_PARALLAX_PX)
    # A cell more on every side: the border of the picture is no edge here.
    around = np.pad(moved, CELL_PX, mode="edge")
    step = np.empty([-(-length // CELL_PX) for length in around.shape], np.float32)
    in_bands(lambda first, last: largest_steps(around, first, last, step), image_size(around))
    return ParallaxStatistics(
        image_size(moved),
        step[1:-1, 1:-1],
        _spread(moved),
        float(np.abs(moved).max()),
    )


def _spread(moved: FloatImage) -> FloatImage:
    """`ParallaxStatistics.spread` of disparities (H, W)."""
    from iibr_core.rendering.ray_cells import over_cells

    around = []
    for extreme in (np.maximum, np.minimum):
        found = np.pad(over_cells(extreme, moved), ((0, 1), (0, 1)), mode="edge")
        found = extreme(found[1:], found[:-1])
        around.append(extreme(found[:, 1:], found[:, :-1]))
    return np.asarray(around[0] - around[1])


def largest_offset(grid: GridShape) -> float:
    """The largest view offset of a grid, view steps."""
    return max(abs(part) for v in (0, grid.rows - 1) for u in (0, grid.columns - 1) for part in grid.offset(v, u))


def estimate_costs(statistics: ParallaxStatistics, grid: GridShape) -> CostEstimates:
    """What making all views of a grid takes."""
    found = []
    for quality in get_args(Quality):
        work = estimate_workload(statistics, grid, quality)
        seconds = sum(amount * each for amount, each in zip(work, NANOSECONDS)) * 1e-9 / CORES
        drafts = _draft_bytes(statistics, grid) if quality == "balanced" else 0
        found.append(CostEstimate(seconds, drafts))
    return CostEstimates(*found)


def estimate_workload(statistics: ParallaxStatistics, grid: GridShape, quality: Quality) -> Workload:
    """What there is to do for all views of a grid in one quality."""
    pixels, views, asks = statistics.pixels, grid.rows * grid.columns - 1, quality != "fast"
    # The outer views complete the ray set, which takes as long as they do; for the transformer they are made again.
    more = (2 if asks else 1) * _inpainted_views(statistics, grid)
    rough = _sum_over_views(statistics.rough_share, grid) + more * statistics.rough_share(1.0)
    rays = _sum_over_views(statistics.ambiguous_share, grid) if asks else 0.0
    return Workload(pixels * (views + more), pixels * rough, pixels * rays)


def _sum_over_views(share: Callable[[float], float], grid: GridShape) -> float:
    """A share of the rays, which depends on the parallax, summed over all views."""
    outermost = largest_offset(grid)
    offsets = (grid.offset(v, u) for v in range(grid.rows) for u in range(grid.columns))
    rings = Counter(max(abs(at.t), abs(at.s)) / outermost for at in offsets if outermost > 0)
    return sum(count * share(parallax) for parallax, count in rings.items())


def _inpainted_views(statistics: ParallaxStatistics, grid: GridShape) -> int:
    return len(outer_views_of_grid(grid)) if statistics.has_disocclusion else 0


def _draft_bytes(statistics: ParallaxStatistics, grid: GridShape) -> int:
    """What drafts take once all views are there. Those of inpainted views lie in the ray set."""
    views = grid.rows * grid.columns - 1
    drafts = views - _inpainted_views(statistics, grid)
    undecided = _sum_over_views(statistics.ambiguous_share, grid) * drafts / max(views, 1)
    return round(statistics.pixels * (drafts * DRAFT_BYTES + undecided * undecided_bytes()))


def undecided_bytes() -> int:
    """Of a ray that the transformer is still to be asked for. Imported here: a plan loads kernels once it is made."""
    from iibr_core.rendering.ambiguous_rays import HYPOTHESES

    return 9 + 13 * HYPOTHESES
