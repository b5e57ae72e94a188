"""Comparison of ways of making views on the trials of a scene: the unchanged photo, one plane, the plain warp, iibr.

Figures are those of the whole frame, of the part that the given view sees, and of holes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import astuple, dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, quantise_as_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.consistency import consistency
from iibr_core.evaluation.metrics import Mask, bounded_psnr, flip, ssim
from iibr_core.evaluation.refocus import FocalStack, Focus, foci_of
from iibr_core.evaluation.scenes import (
    CENTRE_TRIAL,
    FITTED,
    DisparityFrom,
    Trial,
    free_views,
    plane_views,
    read_view,
    trial_input,
    trials_of,
    warp_view,
)
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.runtime.tiling import side_by_side
from iibr_core.runtime.work import part_of_job, report_progress
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import Disparity, FloatImage, ImageSize, ViewOffset, image_size

TRUTH, PHOTO, PLANE, WARP, OURS = "truth", "unchanged photo", "one plane", "plain warp", "iibr"
"""The true views, and ways of making views."""
SAME_ROW = 0.05
"""Largest distance, in view steps, of the rows of views that make an EPI together."""

MakeView = Callable[[int], FloatImage]
"""Makes the view (H, W, 3) of an index of the scene."""
Distance = Callable[[FloatImage, FloatImage], float]
Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class Options:
    """disparity: its origin; a file is the centre view's map. choice: how depth is estimated and refined.

    max_pixels: size of the pictures. views: most views that are judged. lpips: folder with its weights. stages: those
    between map and view that are on.
    """

    disparity: DisparityFrom | Path = "given"
    choice: DepthChoice = field(default_factory=DepthChoice)
    max_pixels: int = DEFAULT_MAX_PIXELS
    views: int | None = None
    lpips: Path | None = None
    stages: Stages = ALL_STAGES


@dataclass(frozen=True)
class Figures:
    """PSNR in dB of the frame, of what the given view sees, and of holes; SSIM, FLIP and LPIPS of the frame."""

    full_db: float
    visible_db: float
    hole_db: float
    ssim: float
    flip: float
    lpips: float


@dataclass(frozen=True)
class Row:
    """One way of making views by one kind of disparity map, "" for ways that need none.

    mean: figures over the views (of holes over those that have any). consistency: rms difference of inpainted content
    between views, in 1/255, NaN for other ways. refocus_db: PSNR of refocused pictures by the name of the focus.
    """

    way: str
    disparity: str
    mean: Figures
    consistency: float
    refocus_db: Mapping[str, float]
    views: Mapping[str, Figures]

    @property
    def name(self) -> str:
        """The way and its disparity."""
        return f"{self.way}, {self.disparity}" if self.disparity else self.way

    @property
    def worst_view(self) -> str:
        """Name of the view with the lowest PSNR."""
        return min(self.views, key=lambda name: self.views[name].full_db)


@dataclass(frozen=True, eq=False)
class Result:
    """One trial.

    given: name of the given view. hole_share: share of holes in the judged views. foci: those of `refocus_db`.
    pictures: (H, W, 3), sRGB-encoded, by a title and by the way, that of the true views first.
    """

    scene: str
    layout: str
    trial: str
    given: str
    size: ImageSize
    hole_share: float
    rows: tuple[Row, ...]
    foci: tuple[Focus, ...]
    notes: tuple[str, ...]
    pictures: Mapping[str, Mapping[str, Bytes]]


@dataclass(frozen=True, eq=False)
class _View:
    """A judged view. visible, hole: (H, W), the parts that the given view sees, and does not see."""

    index: int
    name: str
    offset: ViewOffset
    visible: Mask
    hole: Mask


@dataclass(frozen=True, eq=False)
class _Look:
    """All that is kept of the views of one way: figures by view, and pictures (H, W, 3) by title."""

    figures: Mapping[str, Figures]
    pictures: Mapping[str, FloatImage]


def evaluate(scene: MultiView, options: Options | None = None) -> list[Result]:
    """Evaluate a scene by the paper's trials, with a result for each.

    With an estimate, the rows show what the photo alone gives: "one plane", and "iibr" by a model's depth, by a guess
    and by the true map. Raises InputError if the scene or an option is bad.
    """
    options = options or Options()
    lpips = _lpips(options.lpips) if options.lpips else None
    trials = trials_of(scene, options.disparity, options.views)
    results = []
    for number, trial in enumerate(trials):
        report_progress(number, len(trials), f"{scene.name}: disparity")
        with part_of_job(number, 1, len(trials)):
            results.append(_TrialRun(trial, options, lpips).result())
    return results


def _lpips(folder: Path) -> Distance:
    from iibr_core.evaluation.lpips import Lpips  # only LPIPS needs torch

    return Lpips(folder)


class _TrialRun:
    """One trial, way by way."""

    def __init__(self, trial: Trial, options: Options, lpips: Distance | None) -> None:
        self._trial, self._options, self._lpips = trial, options, lpips
        self._given = trial_input(trial, options.disparity, options.choice, options.max_pixels)
        self._views = [self._judged(index) for index in trial.judged]
        is_lens = trial.name == CENTRE_TRIAL and not trial.is_free
        offsets = [view.offset for view in self._views]
        self._foci = foci_of(offsets, self._given.judge.values) if is_lens else []

    def _judged(self, index: int) -> _View:
        warped = warp_view(self._trial, self._given.photo, self._given.judge.values, index)
        name = self._trial.scene.views[index].name
        return _View(index, name, self._trial.offset(index), warped.visible, warped.hole)

    def result(self) -> Result:
        """Return the figures of all ways."""
        scene, given = self._trial.scene, self._given
        truth = self._look(self._true_view)
        pictures = {title: {TRUTH: bytes_from_encoded(picture)} for title, picture in truth.pictures.items()}
        rows = []
        for number, (way, disparity, make, agreement) in enumerate(self._ways()):
            report_progress(number, 3 + 2 * len(given.maps), f"{scene.name}: {way}")
            look = self._look(make)
            refocus = {f.name: bounded_psnr(look.pictures[f.title], truth.pictures[f.title]) for f in self._foci}
            rows.append(Row(way, disparity, _mean(look.figures.values()), agreement, refocus, look.figures))
            for title, picture in look.pictures.items():
                pictures[title][rows[-1].name] = bytes_from_encoded(picture)
        return Result(
            scene.name,
            scene.layout,
            self._trial.name,
            scene.views[self._trial.given].name,
            image_size(given.photo),
            float(np.mean([view.hole.mean() for view in self._views])),
            tuple(rows),
            tuple(self._foci),
            (*scene.notes, *dict.fromkeys(note for kind in given.maps for note in _notes(kind, given.maps[kind]))),
            pictures,
        )

    def _ways(self) -> Iterator[tuple[str, str, MakeView, float]]:
        """Yield all ways of making views: name, disparity, function, and consistency."""
        photo, plane = self._given.photo, np.full_like(self._given.judge.values, self._given.fit.plane)
        yield PHOTO, "", lambda index: photo, math.nan
        yield PLANE, "", self._warp(plane), math.nan
        for kind, disparity in self._given.maps.items():
            yield WARP, kind, self._warp(disparity.values), math.nan
            yield OURS, kind, *self._own(disparity)

    def _true_view(self, index: int) -> FloatImage:
        return read_view(self._trial.scene.views[index], self._options.max_pixels)

    def _warp(self, disparity: FloatImage) -> MakeView:
        return lambda index: warp_view(self._trial, self._given.photo, disparity, index).colors

    def _own(self, disparity: Disparity) -> tuple[MakeView, float]:
        """Return the function that makes the program's views, and their consistency."""
        trial, photo, options, values = self._trial, self._given.photo, self._options, disparity.values
        if options.choice.refine:
            values = refine(photo, values, disparity.unknown, options.stages, disparity.is_enlarged)
        if trial.is_free:
            free = free_views(trial, photo, values, options.stages)
            return lambda index: free(index).colors, math.nan
        make = plane_views(trial, photo, values, options.stages)
        agreement = consistency(make, [view.offset for view in self._views])
        return lambda index: make(trial.offset(index)).colors, agreement

    def _look(self, make: MakeView) -> _Look:
        """Return the figures of a way's views, and its pictures: the farthest view, an EPI, refocused ones."""
        photo, judge = self._given.photo, self._given.judge.values
        farthest = max(self._views, key=lambda view: math.hypot(*view.offset))
        row = int(np.abs(np.diff(judge, axis=1)).sum(axis=1).argmax())  # its EPI crosses most depth edges
        figures, shown, lines, stack = {}, photo, {0.0: photo[row]}, FocalStack(self._foci, photo)
        made = ((view, quantise_as_stored(make(view.index))) for view in self._views)
        for view, image, distances in side_by_side(self._score, made):
            figures[view.name] = distances
            stack.add(view.offset, image)
            shown = image if view is farthest else shown
            if abs(view.offset.t) <= SAME_ROW:
                lines[view.offset.s] = image[row]
        pictures = {f"The farthest view, {farthest.name}": shown}
        if len(lines) > 2:
            epi = np.stack([lines[s] for s in sorted(lines)])
            pictures[f"EPI of pixel row {row}, leftmost view on top"] = np.repeat(epi, 8, axis=0)
        return _Look(figures, {**pictures, **stack.pictures()})

    def _score(self, made: tuple[_View, FloatImage]) -> tuple[_View, FloatImage, Figures]:
        view, image = made
        truth = self._true_view(view.index)
        full, visible, hole = (bounded_psnr(image, truth, mask) for mask in (None, view.visible, view.hole))
        lpips = math.nan if self._lpips is None else self._lpips(image, truth)
        return view, image, Figures(full, visible, hole, ssim(image, truth), flip(image, truth), lpips)


def _mean(figures: Iterable[Figures]) -> Figures:
    """Return the means over views, of each figure over the views that have it."""
    table = np.array([astuple(of_view) for of_view in figures])
    known = np.isfinite(table)
    means = np.where(known, table, 0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)
    return Figures(*means.tolist())


def _notes(kind: str, disparity: Disparity) -> tuple[str, ...]:
    return () if kind.endswith(FITTED) else (f"The {kind} is {disparity.source}.", *disparity.notes)
