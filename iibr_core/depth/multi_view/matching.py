"""What views are matched by, and how badly they match where the reference view has a disparity.

Light on a surface changes slowly from view to view and across it; its texture hardly does. So texture is matched: what
a guided filter takes out of the luma, which leaves out the rings that a plain blur makes about depth edges. With 81
views, differences far below the noise of one of them decide.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored
from iibr_core.depth.multi_view.guided_filter import GuidedFilter
from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces
from iibr_core.types import FloatImage, StoredColors, ViewOffset

STEP_PX = 0.5
"""By which the farthest view's match moves from one disparity of a sweep to the next."""
MOST_VIEWS = 32
"""Matched against the reference: on eight rays from it, as the others add little."""
TEXTURE_RADIUS_PX = 3
TEXTURE_SMOOTHNESS = 1e-4
"""Of the filter that leaves texture: steps above its root, a hundredth of white, are edges and stay out."""
LUMA_SHARE = 0.1
"""Of the luma itself beside the texture: where there is none, slow changes tell at least something."""
WINDOW_RADIUS_PX = 2
WINDOW_SMOOTHNESS = 1e-5
"""Of the windows over which costs are averaged."""
MOST_COST = 0.03
"""Root mean square difference of texture (1 = white) from which on two things are unlike, and no more unlike."""
HIDDEN_FACTOR = 1.5
"""How many times better half of the views must match than all for the rest to count as hidden."""
LEAST_SEEN = 0.3
"""Share of the views that must see a place for a match there to count."""
COST_STEPS = 255


@dataclass(frozen=True, eq=False)
class MatchingViews:
    """A reference view and others of the same scene.

    textures: (N, H, W) float32, the reference first. offsets: (N, 2) float32, (t, s) from the reference in view steps.
    luma: (H, W) of the reference.
    """

    textures: NDArray[np.float32]
    offsets: NDArray[np.float32]
    luma: FloatImage

    @property
    def reach(self) -> float:
        """View steps, along a row or column, from the reference to the farthest."""
        return float(np.abs(self.offsets).max())


def choose_views(offsets: list[ViewOffset], reference: int) -> list[int]:
    """Which views to match, the reference first: those on eight rays from it, up to MOST_VIEWS; all if few are there.

    Of more, those nearest to equal distances along the rays.
    """
    at = offsets[reference]
    others = [index for index in range(len(offsets)) if index != reference]
    on_rays = [index for index in others if _is_on_ray(offsets[index].t - at.t, offsets[index].s - at.s)]
    chosen = on_rays if len(on_rays) >= min(8, len(others)) else others
    chosen.sort(key=lambda index: hypot(offsets[index].t - at.t, offsets[index].s - at.s))
    kept = np.unique(np.linspace(0, len(chosen) - 1, min(len(chosen), MOST_VIEWS)).round().astype(int))
    return [reference, *(chosen[index] for index in kept)]


def luma_of(colors: StoredColors, shrink: int = 1) -> FloatImage:
    """What is matched of a view (H, W, 3): the mean of its channels, 0 .. 1, of squares of `shrink` pixels."""
    luma = np.clip(np.nan_to_num(encoded_from_stored(colors), nan=0.0, posinf=1.0, neginf=0.0), 0, 1).mean(axis=-1)
    rows, columns = (length // shrink for length in luma.shape)
    squares = luma[: rows * shrink, : columns * shrink].reshape(rows, shrink, columns, shrink)
    return np.ascontiguousarray(squares.mean(axis=(1, 3)), np.float32)


def matching_views(lumas: list[FloatImage], offsets: list[ViewOffset]) -> MatchingViews:
    """Views ready for matching. lumas: (H, W) each, the reference first. offsets: from any origin.

    Raises ValueError where sizes differ or there are fewer than two.
    """
    if len(lumas) < 2 or len({luma.shape for luma in lumas}) != 1 or len(lumas) != len(offsets):
        raise ValueError(f"{len(lumas)} pictures of {len({luma.shape for luma in lumas})} sizes cannot be matched")
    textures = in_pieces(_texture, lumas, tiling.THREADS)
    relative = np.array(offsets, np.float32) - np.array(offsets[0], np.float32)
    return MatchingViews(np.stack(textures), relative, lumas[0])


def sweep(
    views: MatchingViews,
    disparities: NDArray[np.float32],
    report_step: Callable[[], None] = lambda: None,
) -> NDArray[np.uint8]:
    """(H, W, D): how badly the views match each pixel of the reference at each of D disparities; 255: not at all.

    A pixel that some views do not see matches in one half of them: left, right, upper or lower. report_step: called
    after each disparity, by one thread at a time.
    """
    reporting = threading.Lock()
    height, width = views.luma.shape
    costs = np.empty((height, width, len(disparities)), np.uint8)
    window = GuidedFilter(views.luma, WINDOW_RADIUS_PX, WINDOW_SMOOTHNESS)

    def sweep_one(index: int) -> None:
        parts = np.empty((5, height, width), np.float32)
        _match(views.textures, views.offsets, disparities[index], np.float32(MOST_COST**2), parts)
        own = window.twin()
        for part in parts:
            own.apply(part)
        _store_costs(parts, np.float32(MOST_COST**2), costs[:, :, index])
        with reporting:
            report_step()

    in_pieces(sweep_one, range(len(disparities)), tiling.THREADS)
    return costs


def _is_on_ray(t: float, s: float) -> bool:
    return t == 0 or s == 0 or abs(t) == abs(s)


def _texture(luma: FloatImage) -> FloatImage:
    smooth = luma.copy()
    GuidedFilter(luma, TEXTURE_RADIUS_PX, TEXTURE_SMOOTHNESS).apply(smooth)
    return luma - np.float32(1 - LUMA_SHARE) * smooth


@kernel
def _match(textures, offsets, disparity, most, parts):
    """parts: mean squared difference at one disparity over the left, right, upper, lower views, and over all.

    All of a view is shifted alike: row after row, so that one instruction compares several pixels.
    """
    count, height, width = textures.shape
    least_seen = max(np.float32(LEAST_SEEN * (count - 1)), np.float32(1))
    sums, counts, costs = (
        np.empty((5, width), np.float32),
        np.empty((5, width), np.float32),
        np.empty(width, np.float32),
    )
    for y in range(height):
        sums[:] = 0
        counts[:] = 0
        for view in range(1, count):
            t, s = offsets[view, 0], offsets[view, 1]
            # Where the surface stands in that view (`iibr_core.types`).
            row, shift = y - disparity * t, -disparity * s
            if not (row >= 0 and row <= height - 1 and abs(shift) <= width - 1):
                continue
            y0, x_shift = min(int(row), max(height - 2, 0)), int(np.floor(shift))
            down, across = np.float32(row - y0), np.float32(shift - x_shift)
            # Columns that lie in both views; a shift by whole pixels needs no neighbour.
            beside = 1 if across > 0 else 0
            first, last = max(0, -x_shift), min(width, width - beside - x_shift)
            upper, lower = textures[view, y0], textures[view, min(y0 + 1, height - 1)]
            upper_left, upper_right = upper[first + x_shift :], upper[first + x_shift + beside :]
            lower_left, lower_right = lower[first + x_shift :], lower[first + x_shift + beside :]
            here = textures[0, y, first:last]
            for x in range(len(here)):
                top = upper_left[x] + (upper_right[x] - upper_left[x]) * across
                bottom = lower_left[x] + (lower_right[x] - lower_left[x]) * across
                difference = top + (bottom - top) * down - here[x]
                costs[x] = min(difference * difference, most)
            beside_part = 0 if s < 0 else 1 if s > 0 else -1
            above_part = 2 if t < 0 else 3 if t > 0 else -1
            for part in (beside_part, above_part, 4):
                if part >= 0:
                    own_sums, own_counts = sums[part, first:last], counts[part, first:last]
                    for x in range(len(own_sums)):
                        own_sums[x] += costs[x]
                        own_counts[x] += np.float32(1)
        for x in range(width):
            is_seen = counts[4, x] >= least_seen
            mean = sums[4, x] / counts[4, x] if is_seen else most
            parts[4, y, x] = mean
            for part in range(4):
                parts[part, y, x] = sums[part, x] / counts[part, x] if is_seen and counts[part, x] > 0 else mean


@kernel
def _store_costs(parts, most, costs):
    """The root of what matches best: all views, or the best half, which must be HIDDEN_FACTOR times as good."""
    for y in range(costs.shape[0]):
        for x in range(costs.shape[1]):
            half = min(min(parts[0, y, x], parts[1, y, x]), min(parts[2, y, x], parts[3, y, x]))
            cost = max(min(parts[4, y, x], HIDDEN_FACTOR * half), np.float32(0))
            costs[y, x] = np.uint8(min(np.sqrt(cost / most), np.float32(1)) * COST_STEPS)
