"""What is given and what is judged: the paper's two trials on a scene, and the disparity each is given.

From the centre view to all others, and on grids from the bottom left to the top left one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.alignment import fit_to_views
from iibr_core.evaluation.datasets import read_known_disparity, read_straight_view, read_view
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.formats.light_fields.multi_view_scene import KnownDisparity, MultiView
from iibr_core.inpainting.disparity_holes import fill_disparity_holes
from iibr_core.types import (
    Disparity,
    FloatImage,
    GridShape,
    InputError,
    ViewOffset,
    image_size,
)

DisparityFrom = Literal["auto", "gt", "estimate"]
"""Where the given view's disparity comes from; auto: ground truth, else a map in the folder, else estimated."""
ALIGNING_VIEWS = 4
CENTRE_TRIAL, CORNER_TRIAL = "centre to all others", "bottom left to top left"


@dataclass(frozen=True, eq=False)
class Trial:
    """given: index of the view that is known; judged: those compared."""

    name: str
    scene: MultiView
    given: int
    judged: tuple[int, ...]

    def offset(self, index: int) -> ViewOffset:
        """The viewpoint of a view, from the given one."""
        at, origin = self.scene.views[index].offset, self.scene.views[self.given].offset
        return ViewOffset(at.t - origin.t, at.s - origin.s)


@dataclass(frozen=True, eq=False)
class TrialInput:
    """What a trial starts from.

    photo: (H, W, 3) sRGB-encoded in 0..1. maps: disparities to try, by name. judge: (H, W) disparity that tells holes
    from what is visible. notes: where all this comes from.
    """

    photo: FloatImage
    maps: tuple[Disparity, ...]
    judge: Disparity
    notes: tuple[str, ...]


def trials_of(scene: MultiView, source: DisparityFrom, most_views: int | None = None) -> list[Trial]:
    """The trials of a scene. most_views: judge at most so many, spread over all; the farthest is among them.

    Raises InputError for a bad most_views.
    """
    if most_views is not None and most_views < 1:
        raise InputError(f"--views {most_views}: give 1 or more")
    centre = _given_near_centre(scene, source)
    others = [index for index in range(len(scene.views)) if index != centre]
    trials = [Trial(CENTRE_TRIAL, scene, centre, tuple(_evenly_spaced(others, most_views)))]
    corners = _left_corners(scene)
    if corners is not None:
        bottom, top = corners
        trials.append(Trial(CORNER_TRIAL, scene, bottom, (top,)))
    return trials


def _given_near_centre(scene: MultiView, source: DisparityFrom) -> int:
    """The centre view; where maps are wanted, the one nearest to it that has one."""
    if source == "estimate" or scene.centre in scene.disparity or not scene.disparity:
        return scene.centre
    at = scene.views[scene.centre].offset
    truths = {index for index, known in scene.disparity.items() if known.is_truth} or set(scene.disparity)
    return min(truths, key=lambda k: (scene.views[k].offset.t - at.t) ** 2 + (scene.views[k].offset.s - at.s) ** 2)


def _evenly_spaced(indices: list[int], most: int | None) -> list[int]:
    if most is None or most >= len(indices):
        return indices
    return [indices[round(k)] for k in np.linspace(0, len(indices) - 1, most)]


def _left_corners(scene: MultiView) -> tuple[int, int] | None:
    """The bottom left and the top left view of a grid of several rows and columns; None of other scenes."""
    if any(view.camera is not None for view in scene.views):
        return None
    places = np.array([view.offset for view in scene.views])
    (top, left), (bottom, right) = places.min(axis=0), places.max(axis=0)
    if bottom - top < 0.5 or right - left < 0.5:
        return None
    found = [int(np.hypot(*(places - corner).T).argmin()) for corner in ((bottom, left), (top, left))]
    return found[0], found[1]


def trial_input(
    trial: Trial,
    source: DisparityFrom | Path,
    choice: DepthChoice,
    max_pixels: int,
) -> TrialInput:
    """The given view of a trial and its disparity. source: a file is the centre view's. choice: how one is estimated.

    An estimate comes twice: as it is, and scaled and shifted to the truth (to the true views where no map is known).
    Raises InputError where there is no disparity of the kind asked for, or it cannot be read.
    """
    scene, view = trial.scene, trial.scene.views[trial.given]
    photo = read_view(view, max_pixels)
    truth = _map_of(trial, {k: known for k, known in scene.disparity.items() if known.is_truth}, max_pixels)
    if source == "gt" and truth is None:
        raise InputError(
            f"{view.path}: has no true disparity in its folder; give --disparity estimate, or the name of a file"
        )
    given: Disparity | None = None
    if isinstance(source, Path):
        given = _map_of(trial, {_given_near_centre(scene, "auto"): KnownDisparity(source)}, max_pixels)
    elif source != "estimate":
        given = truth or _map_of(trial, scene.disparity, max_pixels)
    if given is not None:
        return TrialInput(photo, (given,), truth or given, given.notes)
    estimate = _estimate_disparity(trial, choice, max_pixels)
    aligned = _align_to_views(trial, photo, estimate, max_pixels)
    return TrialInput(photo, (estimate, aligned), truth or aligned, estimate.notes)


def _map_of(trial: Trial, maps: Mapping[int, KnownDisparity], max_pixels: int) -> Disparity | None:
    """The given view's own map, or another view's carried over; None where there is none."""
    if not maps:
        return None
    scene = trial.scene
    nearest = min(maps, key=lambda index: sum(part**2 for part in trial.offset(index)))
    colors = read_view(scene.views[nearest], max_pixels)
    stored = read_known_disparity(maps[nearest], image_size(colors), colors)
    if nearest == trial.given:
        return stored
    offset = trial.offset(nearest)
    values = warp_disparity(stored.values, ViewOffset(-offset.t, -offset.s))
    note = f"The disparity of {scene.views[nearest].name} was carried over to {scene.views[trial.given].name}."
    return Disparity(values, f"{stored.source}, carried over", (*stored.notes, note))


def warp_disparity(disparity: FloatImage, offset: ViewOffset) -> FloatImage:
    """The disparity (H, W) of another view, at an offset from its own; what was hidden is filled from behind."""
    warped = reference_warp(np.zeros((*disparity.shape, 3), np.float32), disparity, offset)
    values = np.where(warped.hole, np.float32(np.nan), warped.disparity)
    return disparity if np.isnan(values).all() else fill_disparity_holes(values)


def _estimate_disparity(trial: Trial, choice: DepthChoice, max_pixels: int) -> Disparity:
    """As the program estimates it from the given view alone; in the range that the cameras' poses state, where they do.

    A grid's stated range belongs to its truth, which an estimate does not know.
    """
    reach = [round(2 * max(abs(trial.offset(k)[axis]) for k in trial.judged)) + 1 for axis in (0, 1)]
    path = trial.scene.views[trial.given].path
    start = "model" if choice.asks_for_model else "embedded" if choice.start == "auto" else choice.start
    unrefined = replace(choice, start=start, file=None, refine=False)
    found = open_with_depth(path, unrefined, max_pixels, GridShape(*reach))
    values, words = found.disparity.values, f"estimate ({found.origin.words})"
    if trial.scene.grid is None and trial.scene.range_px is not None:
        values = _within(values, trial.scene.range_px)
    return Disparity(values, words, found.disparity.notes)


def _within(values: FloatImage, range_px: tuple[float, float]) -> FloatImage:
    """Scaled and shifted so that all but the farthest and nearest percent lie in the range."""
    low, high = (float(p) for p in np.percentile(values, (1, 99)))
    if not high > low:
        return values
    share = (values - np.float32(low)) / np.float32(high - low)
    return np.float32(range_px[0]) + np.float32(range_px[1] - range_px[0]) * share


def _align_to_views(trial: Trial, photo: FloatImage, estimate: Disparity, max_pixels: int) -> Disparity:
    farthest = sorted(trial.judged, key=lambda k: -max(map(abs, trial.offset(k))))[:ALIGNING_VIEWS]
    truths = [(trial.offset(k), read_straight_view(trial.scene.views[k], max_pixels)[0]) for k in farthest]
    values = fit_to_views(photo, estimate.values, truths)
    return Disparity(values, f"{estimate.source}, scale and shift fitted to true views")
