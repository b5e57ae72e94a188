"""Comparison of ways of making views on the trials of a scene: the unchanged photo, one plane, the plain warp, iibr.

Figures are those of the whole frame, of the part that the given view sees, and of holes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import astuple, dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.free_cameras import FreeViews
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
    TrialInput,
    in_front,
    read_view,
    trial_input,
    trials_of,
    warp_view,
)
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.inpainting.background import fill_background
from iibr_core.method.light_field import ViewMaker
from iibr_core.runtime.tiling import side_by_side
from iibr_core.runtime.work import part_of_job, report_progress
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import Disparity, FloatImage, ImageSize, image_size

TRUTH, PHOTO, PLANE, WARP, OURS = "truth", "unchanged photo", "one plane", "plain warp", "iibr"
"""The true views, and ways of making views."""

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
            results.append(_result(trial, options, lpips))
    return results


def _lpips(folder: Path) -> Distance:
    from iibr_core.evaluation.lpips import Lpips  # only LPIPS needs torch

    return Lpips(folder)


def _result(trial: Trial, options: Options, lpips: Distance | None) -> Result:
    """Return the figures of all ways in a trial."""
    scene, given = trial.scene, trial_input(trial, options.disparity, options.choice, options.max_pixels)
    judge = _Judge(trial, given, options.max_pixels, lpips)
    _, true_pictures = judge.look(judge.true_view)
    pictures = {title: {TRUTH: bytes_from_encoded(picture)} for title, picture in true_pictures.items()}
    rows = []
    for number, (way, disparity, make, agreement) in enumerate(_ways(trial, given, options)):
        report_progress(number, 3 + 2 * len(given.maps), f"{scene.name}: {way}")
        figures, shown = judge.look(make)
        refocus = {focus.name: bounded_psnr(shown[focus.title], true_pictures[focus.title]) for focus in judge.foci}
        rows.append(Row(way, disparity, _mean(figures.values()), agreement, refocus, figures))
        for title, picture in shown.items():
            pictures[title][rows[-1].name] = bytes_from_encoded(picture)
    return Result(
        scene.name,
        scene.layout,
        trial.name,
        scene.views[trial.given].name,
        image_size(given.photo),
        float(np.mean([hole.mean() for _, hole in judge.parts.values()])),
        tuple(rows),
        tuple(judge.foci),
        (*scene.notes, *dict.fromkeys(note for kind in given.maps for note in _notes(kind, given.maps[kind]))),
        pictures,
    )


def _ways(trial: Trial, given: TrialInput, options: Options) -> Iterator[tuple[str, str, MakeView, float]]:
    """Yield all ways of making views: name, disparity, function, and consistency."""

    def warp(disparity: FloatImage) -> MakeView:
        return lambda index: warp_view(trial, given.photo, disparity, index).colors

    yield PHOTO, "", lambda index: given.photo, math.nan
    yield PLANE, "", warp(np.full_like(given.judge.values, given.fit.plane)), math.nan
    for kind, disparity in given.maps.items():
        yield WARP, kind, warp(disparity.values), math.nan
        yield OURS, kind, *_own_views(trial, given.photo, disparity, options)


def _own_views(trial: Trial, photo: FloatImage, disparity: Disparity, options: Options) -> tuple[MakeView, float]:
    """Return the function that makes the program's views, and their consistency."""
    values, stages = disparity.values, options.stages
    if options.choice.refine:
        values = refine(photo, values, disparity.unknown, stages, disparity.is_enlarged)
    if not trial.is_free:
        offsets = [trial.offset(index) for index in trial.judged]
        make = ViewMaker(photo, values, offsets, stages=stages).view
        return lambda index: make(trial.offset(index)).colors, consistency(make, offsets)
    given, *others = (trial.camera(index, image_size(photo)) for index in (trial.given, *trial.judged))
    inverse_depth = (in_front(given, values) / np.float32(given.focal_px[0])).astype(np.float32)
    free = FreeViews(photo, inverse_depth, given, others, partial(fill_background, stages=stages), stages=stages)
    cameras = dict(zip(trial.judged, others))
    return lambda index: free.view(cameras[index]).colors, math.nan


class _Judge:
    """Compares views of a trial with the true ones. parts: visible part and holes (H, W) by the view's index."""

    def __init__(self, trial: Trial, given: TrialInput, max_pixels: int, lpips: Distance | None) -> None:
        self._trial, self._given, self._max_pixels, self._lpips = trial, given, max_pixels, lpips
        self.parts: dict[int, tuple[Mask, Mask]] = {}
        for index in trial.judged:
            warped = warp_view(trial, given.photo, given.judge.values, index)
            self.parts[index] = warped.visible, warped.hole
        is_lens = trial.name == CENTRE_TRIAL and not trial.is_free
        self.foci = foci_of(list(map(trial.offset, trial.judged)), given.judge.values) if is_lens else []

    def true_view(self, index: int) -> FloatImage:
        """Return the true view (H, W, 3) of an index."""
        return read_view(self._trial.scene.views[index], self._max_pixels)

    def look(self, make: MakeView) -> tuple[dict[str, Figures], dict[str, FloatImage]]:
        """Return the figures of a way's views by name, and pictures: the farthest view, an EPI, refocused ones."""
        trial, photo, names = self._trial, self._given.photo, [view.name for view in self._trial.scene.views]
        farthest = max(trial.judged, key=lambda index: math.hypot(*trial.offset(index)))
        row = int(np.abs(np.diff(self._given.judge.values, axis=1)).sum(axis=1).argmax())  # crosses most depth edges
        figures, shown, lines, stack = {}, photo, {0.0: photo[row]}, FocalStack(self.foci, photo)
        made = ((index, quantise_as_stored(make(index))) for index in trial.judged)
        for index, image, distances in side_by_side(self._score, made):
            figures[names[index]], offset = distances, trial.offset(index)
            stack.add(offset, image)
            shown = image if index == farthest else shown
            if round(offset.t, 1) == 0:
                lines[offset.s] = image[row]
        pictures = {f"The farthest view, {names[farthest]}": shown}
        if len(lines) > 2:
            epi = np.stack([lines[s] for s in sorted(lines)])
            pictures[f"EPI of pixel row {row}, leftmost view on top"] = np.repeat(epi, 8, axis=0)
        return figures, pictures | stack.pictures()

    def _score(self, made: tuple[int, FloatImage]) -> tuple[int, FloatImage, Figures]:
        index, image = made
        truth = self.true_view(index)
        full, visible, hole = (bounded_psnr(image, truth, mask) for mask in (None, *self.parts[index]))
        lpips = math.nan if self._lpips is None else self._lpips(image, truth)
        return index, image, Figures(full, visible, hole, ssim(image, truth), flip(image, truth), lpips)


def _mean(figures: Iterable[Figures]) -> Figures:
    """Return the means over views, of each figure over the views that have it."""
    table = np.ma.masked_invalid([astuple(of_view) for of_view in figures])
    return Figures(*table.mean(axis=0).filled(np.nan).tolist())


def _notes(kind: str, disparity: Disparity) -> tuple[str, ...]:
    return () if kind.endswith(FITTED) else (f"The {kind} is {disparity.source}.", *disparity.notes)
