"""Cost of each disparity at each pixel of a view: how much other views differ there from it (a plane sweep).

Light on a surface changes slowly from view to view and across it; its texture hardly does. So texture is matched: luma
minus its guided filter, which leaves no rings beside depth edges, as a plain blur does. With 81 views, differences far
below the noise of one view decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from math import hypot
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.guided_filter import GuidedFilter
from iibr_core.formats.light_fields.multi_view_scene import line_numbers
from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces
from iibr_core.runtime.work import report_progress
from iibr_core.types import FloatImage, InputError, StoredColors, ViewOffset, image_size

FINDING = "finding disparity"
STEP_PX = 0.5
"""Shift of the farthest view between two disparities of a sweep, in pixels."""
MAX_VIEWS = 32
"""Largest number of views that are matched to the reference."""
TEXTURE_RADIUS_PX, TEXTURE_SMOOTHNESS = 3, 1e-4
"""Guided filter whose result is taken from the luma: steps above 0.01 are edges and are taken, too."""
LUMA_SHARE = 0.1
"""Share of the luma that is kept beside its texture, for surfaces without texture."""
WINDOW_RADIUS_PX, WINDOW_SMOOTHNESS = 2, 1e-5
"""Guided filter that averages costs."""
SAME_LINE = 0.3
"""Largest distance of views of one row or column along it, in the widest distances of neighbouring views."""
MAX_TEXTURE_DIFFERENCE = 0.03
"""Difference of texture (1 = white) that costs most: larger ones cost the same."""
HIDDEN_FACTOR = 1.5
"""Factor by which a group of the views must match better than all, so that the others count as hidden."""
HIDDEN_DIFFERENCE = 0.0012
"""Difference of texture (1 = white) that a group costs at least: outlines of plain objects count by it."""
MIN_LINE_VIEWS = 4
"""Smallest number of views on a line that count as a group: two of them match along outlines at any disparity."""
LINE_SINE = 0.3
"""Sine of the largest angle between the views of one line."""
MIN_SEEN_SHARE = 0.3
"""Smallest share of the views that must see a place."""


@dataclass(frozen=True, eq=False)
class MatchingViews:
    """A reference view and other views of the same scene.

    textures: (N, H, W) float32, the reference first. offsets: (N, 2) float32, (t, s) from the reference in view steps.
    groups: (G, N), the views of each group; the last one is that of all. luma: (H, W) of the reference. colors: (H, W,
    3), sRGB-encoded.
    """

    textures: NDArray[np.float32]
    offsets: NDArray[np.float32]
    groups: NDArray[np.bool_]
    luma: FloatImage
    colors: FloatImage

    @property
    def reach(self) -> float:
        """View steps, along a row or column, from the reference to the farthest view."""
        return float(np.abs(self.offsets).max())


def matching_views(
    views: Sequence[StoredColors], offsets: Sequence[ViewOffset], reference: int, shrink: int = 1
) -> MatchingViews:
    """Return a view, by its index, and the views to match it with, `shrink` times smaller.

    views: (H, W, 3) each, of equal size. offsets: their viewpoints, from any origin. Raises InputError if all views
    have the same viewpoint.
    """
    if len(set(offsets)) < 2:
        raise InputError("all views have the same viewpoint, so no depth can be found")
    chosen = choose_views(offsets, reference)
    textures = np.stack(in_pieces(lambda index: texture_of(views[index], shrink), chosen, tiling.THREADS))
    relative = np.array([offsets[index] for index in chosen], np.float32) - np.array(offsets[reference], np.float32)
    colors = colors_of(views[reference], shrink)
    return MatchingViews(textures, relative, view_groups(relative), luma_of(views[reference], shrink), colors)


def texture_of(colors: StoredColors, shrink: int = 1) -> FloatImage:
    """Return what is matched of a view (H, W, 3): its texture and a little of its luma, `shrink` times smaller."""
    luma = luma_of(colors, shrink)
    smooth = luma.copy()
    GuidedFilter(luma, TEXTURE_RADIUS_PX, TEXTURE_SMOOTHNESS).apply(smooth[None])
    return luma - np.float32(1 - LUMA_SHARE) * smooth


def choose_views(offsets: Sequence[ViewOffset], reference: int) -> list[int]:
    """Return the indices of the views to match, the reference first: up to MAX_VIEWS on eight rays from it.

    All views count if fewer than eight are on the rays. Of too many views, those at even distances are taken.
    """
    places = np.array(offsets, float)
    gaps = np.diff(np.sort(places, axis=0), axis=0).max(axis=0)
    lines = np.stack([line_numbers(axis, SAME_LINE * gap) for axis, gap in zip(places.T, gaps)], axis=1)
    steps, away = np.abs(lines - lines[reference]), places - places[reference]
    others = sorted(set(range(len(offsets))) - {reference}, key=lambda index: hypot(*away[index]))
    on_rays = [index for index in others if 0 in steps[index] or steps[index, 0] == steps[index, 1]]
    chosen = on_rays if len(on_rays) >= min(8, len(others)) else others
    kept = np.linspace(0, len(chosen) - 1, min(len(chosen), MAX_VIEWS)).round().astype(int)
    return [reference, *(chosen[index] for index in kept)]


def view_groups(offsets: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return groups of views (G, N) that may see a place that others do not: on one side of the reference, or on one
    line through it. The last group holds all. offsets: (N, 2), (t, s) from the reference, which is the first.
    """
    t, s = offsets.T
    angle = np.arctan2(t, s)
    everything = np.hypot(t, s) > 0
    lines = [np.asarray(np.abs(np.sin(angle - at * np.pi / 4)) < LINE_SINE) & everything for at in range(4)]
    lines = [line for line in lines if np.count_nonzero(line) >= MIN_LINE_VIEWS]
    groups = [np.asarray(side) & everything for side in (s < 0, s > 0, t < 0, t > 0)] + lines
    return np.stack([*(group for group in groups if group.any() and (group != everything).any()), everything])


def luma_of(colors: StoredColors, shrink: int = 1) -> FloatImage:
    """Return the mean of the channels of a view (H, W, 3), 0 .. 1, over squares of `shrink` pixels."""
    sums, white = _sums_over_squares(colors, shrink)
    return np.asarray(sums.sum(axis=2) / np.float32(white * sums.shape[2]))


def colors_of(colors: StoredColors, shrink: int = 1) -> FloatImage:
    """Return the colours of a view (H, W, 3), sRGB-encoded, 0 .. 1, means over squares of `shrink` pixels."""
    sums, white = _sums_over_squares(colors, shrink)
    return sums / np.float32(white)


def _sums_over_squares(colors: StoredColors, shrink: int) -> tuple[FloatImage, int]:
    """Return the sums (H, W, C) of a view's channels over squares of `shrink` pixels, and that of white."""
    height, width = (length // shrink for length in image_size(colors))
    is_hdr, values = colors.dtype != np.uint8, colors.astype(np.float32)
    if is_hdr:
        values = np.clip(np.nan_to_num(values, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
    sums = np.zeros((height, width, colors.shape[2]), np.float32)
    for y, x in np.ndindex(shrink, shrink):
        sums += values[y::shrink, x::shrink][:height, :width]
    return sums, (1 if is_hdr else 255) * shrink**2


def sweep(views: MatchingViews, disparities: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the cost (H, W, D) of each of D disparities at each pixel of the reference: 0 equal, 255 unlike.

    A pixel that some views do not see is matched in a group of them. Every disparity counts as one step of progress.
    """
    costs = np.empty((*views.luma.shape, len(disparities)), np.uint8)
    window = GuidedFilter(views.luma, WINDOW_RADIUS_PX, WINDOW_SMOOTHNESS)
    steps, reporting = count(1), Lock()

    def sweep_one(index: int) -> None:
        parts = np.empty((len(views.groups), *views.luma.shape), np.float32)
        match_at(views.textures, views.offsets, views.groups, disparities[index], parts)
        window.apply(parts)
        _store_costs(parts, costs[:, :, index])
        with reporting:
            report_progress(next(steps), len(disparities), FINDING)

    in_pieces(sweep_one, range(len(disparities)), tiling.THREADS)
    return costs


@kernel
def match_at(textures, offsets, groups, disparity, parts):
    """Fill parts with mean square differences at one disparity to the views of each group; the last one is of all.

    All pixels of a row shift alike, so that one instruction compares several of them.
    """
    views, height, width = textures.shape
    last = len(groups) - 1
    most = np.float32(MAX_TEXTURE_DIFFERENCE**2)
    min_seen = max(np.float32(MIN_SEEN_SHARE * (views - 1)), np.float32(1))
    sums, counts = np.empty((last + 1, width), np.float32), np.empty((last + 1, width), np.float32)
    costs = np.empty(width, np.float32)
    for y in range(height):
        sums[:] = 0
        counts[:] = 0
        for view in range(1, views):
            t, s = offsets[view, 0], offsets[view, 1]
            # Place of the surface in that view (`iibr_core.types`).
            row, shift = y - disparity * t, -disparity * s
            if not (row >= 0 and row <= height - 1 and abs(shift) <= width - 1):
                continue
            y0, x_shift = min(int(row), max(height - 2, 0)), int(np.floor(shift))
            down, across = np.float32(row - y0), np.float32(shift - x_shift)
            # Columns that lie in both views; a shift by whole pixels needs no neighbour.
            beside = 1 if across > 0 else 0
            first, end = max(0, -x_shift), min(width, width - beside - x_shift)
            upper, lower = textures[view, y0], textures[view, min(y0 + 1, height - 1)]
            upper_left, upper_right = upper[first + x_shift :], upper[first + x_shift + beside :]
            lower_left, lower_right = lower[first + x_shift :], lower[first + x_shift + beside :]
            reference = textures[0, y, first:end]
            for x in range(len(reference)):
                top = upper_left[x] + (upper_right[x] - upper_left[x]) * across
                bottom = lower_left[x] + (lower_right[x] - lower_left[x]) * across
                difference = top + (bottom - top) * down - reference[x]
                costs[x] = min(difference * difference, most)
            for group in range(last + 1):
                if groups[group, view]:
                    group_sums, group_counts = sums[group, first:end], counts[group, first:end]
                    for x in range(len(group_sums)):
                        group_sums[x] += costs[x]
                        group_counts[x] += np.float32(1)
        for x in range(width):
            is_seen = counts[last, x] >= min_seen
            mean = sums[last, x] / counts[last, x] if is_seen else most
            for group in range(last + 1):
                parts[group, y, x] = sums[group, x] / counts[group, x] if is_seen and counts[group, x] > 0 else mean


@kernel
def _store_costs(parts, costs):
    """Fill costs with the root of the mean over all views, or over a group that is HIDDEN_FACTOR times better."""
    last = len(parts) - 1
    for y in range(costs.shape[0]):
        for x in range(costs.shape[1]):
            least = parts[last, y, x]
            for group in range(last):
                least = min(least, parts[group, y, x])
            square = max(min(parts[last, y, x], max(HIDDEN_FACTOR * least, HIDDEN_DIFFERENCE**2)), np.float32(0))
            costs[y, x] = np.uint8(255 * min(np.sqrt(square) / np.float32(MAX_TEXTURE_DIFFERENCE), np.float32(1)))
