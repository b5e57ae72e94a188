"""Compare every way of making views on one trial: identity, reference warp, and this program.

Each judged view is read once and made by every method; figures are of the whole frame, of what the given view sees,
and of holes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from iibr_core.color import bytes_from_encoded, quantise_as_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.consistency import Consistency, LineView, consistency, line_straightness
from iibr_core.evaluation.focal_stacks import FocalStack, RefocusResult, foci_of, lens_focus, score_methods
from iibr_core.evaluation.lens_picture import LensPicture, read_lens_picture
from iibr_core.evaluation.lpips import Lpips  # brings torch
from iibr_core.evaluation.metrics import Mask, bounded_psnr, flip, ssim
from iibr_core.evaluation.reference_warp import WarpedView
from iibr_core.evaluation.results import (
    IDENTITY,
    OURS,
    REFERENCE,
    TRUTH,
    Bytes,
    EvaluationResult,
    Figures,
    Pictures,
    row_of,
)
from iibr_core.evaluation.trial_views import PlaneViews, TrialViews, trial_views
from iibr_core.evaluation.trials import CENTRE_TRIAL, DisparityFrom, Trial, TrialInput, trial_input, trials_of
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.runtime.work import part_of_job, report_progress
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import (
    Disparity,
    FloatImage,
    ViewOffset,
    image_size,
)

if TYPE_CHECKING:
    from iibr_core.evaluation.lpips import Lpips

SAME_ROW = 0.05
"""Views whose rows differ by less, in view steps, make an EPI together."""
LEAST_EPI_VIEWS = 3


@dataclass(frozen=True)
class Options:
    """source: where disparity comes from. choice: how it is estimated and refined. most_views: judged in one trial.

    stages: that are on, between map and view.
    """

    source: DisparityFrom | Path = "auto"
    choice: DepthChoice = field(default_factory=DepthChoice)
    max_pixels: int = DEFAULT_MAX_PIXELS
    most_views: int | None = None
    lpips: Path | None = None
    with_consistency: bool = True
    with_refocus: bool = True
    stages: Stages = ALL_STAGES


def evaluate(
    scene: MultiView,
    options: Options | None = None,
) -> list[EvaluationResult]:
    """Evaluate a scene by the paper's trials: one result for each trial and disparity map.

    Raises InputError where the scene or an option is bad.
    """
    options = options or Options()
    lpips = None if options.lpips is None else _lpips(options.lpips)
    source: DisparityFrom = "auto" if isinstance(options.source, Path) else options.source
    results = []
    trials = list(trials_of(scene, source, options.most_views))
    for number, trial in enumerate(trials):
        report_progress(number, len(trials), f"{scene.name}: disparity")
        given = trial_input(trial, options.source, options.choice, options.max_pixels)
        for which, disparity in enumerate(given.maps):
            with part_of_job(number + which / len(given.maps), 1 / len(given.maps), len(trials)):
                results.append(_Evaluator(trial, given, disparity, options, lpips).evaluate())
    return results


def _lpips(folder: Path) -> Lpips:
    return Lpips(folder)


class _Evaluator:
    """One trial with one disparity map, view by view."""

    def __init__(
        self,
        trial: Trial,
        given: TrialInput,
        disparity: Disparity,
        options: Options,
        lpips: Lpips | None,
    ) -> None:
        self.trial, self.given, self.disparity, self.options = trial, given, disparity, options
        self.lpips = lpips
        self.refined = disparity.values
        if options.choice.refine:
            self.refined = refine(
                given.photo, disparity.values, disparity.unknown, options.stages, disparity.is_enlarged
            )
        self.figures: dict[str, dict[str, Figures]] = {}
        self.hole_shares: list[float] = []
        self.lines: list[LineView] = []
        self.epis: dict[str, list[tuple[float, FloatImage]]] = {}
        self.shown: tuple[str, dict[str, Bytes]] = ("", {})
        self.epi_row = _row_to_show(disparity.values)
        self.lens: LensPicture | None = None
        self.rays_ms = 0.0  # of each view, its share of the time that the ray set takes
        self.notes = (*trial.scene.notes, *given.notes, *disparity.notes)
        self.stacks = self._stacks() if options.with_refocus and trial.name == CENTRE_TRIAL else {}
        self.farthest = max(trial.judged, key=lambda k: math.hypot(*trial.offset(k)))

    def evaluate(self) -> EvaluationResult:
        trial, scene, start = self.trial, self.trial.scene, time.perf_counter()
        options = self.options
        views = trial_views(trial, self.given.photo, self.refined, options.max_pixels, options.stages)
        self.rays_ms = 1e3 * (time.perf_counter() - start) / len(trial.judged)
        with ThreadPoolExecutor(2, thread_name_prefix="iibr-metrics") as pool:
            for done, index in enumerate(trial.judged):
                report_progress(done, len(trial.judged), f"{scene.name}: {scene.views[index].name}")
                self._judge_view(index, views, pool)
            agreement = {}
            if options.with_consistency and isinstance(views, PlaneViews):
                agreement = self._consistency(views)
        rows = tuple(row_of(method, of_views) for method, of_views in self.figures.items())
        return EvaluationResult(
            scene.name,
            scene.layout,
            trial.name,
            scene.views[trial.given].name,
            image_size(self.given.photo),
            self.disparity.source,
            rows,
            agreement,
            self._score_refocus(),
            Pictures(*self.shown, self._epis(), self.epi_row),
            float(np.mean(self.hole_shares)),
            tuple(dict.fromkeys(self.notes)),
            time.perf_counter() - start,
        )

    def _judge_view(self, index: int, views: TrialViews, pool: ThreadPoolExecutor) -> None:
        offset, view = self.trial.offset(index), self.trial.scene.views[index]
        truth, known = views.truth(index)
        judge = views.warp(self.given.judge.values, index)
        made = {IDENTITY: (self.given.photo, 0.0), **self._reference_view(views, index)}
        start = time.perf_counter()
        colors = quantise_as_stored(views.view(index).colors)
        made[OURS] = colors, self.rays_ms + 1e3 * (time.perf_counter() - start)
        hole, visible = judge.hole & known, judge.visible & known
        self.hole_shares.append(float(hole.mean()))

        def score(method: str) -> Figures:
            image, ms = made[method]
            return self._figures(image, truth, None if known.all() else known, visible, hole, ms)

        for method, figures in zip(made, pool.map(score, made)):
            self.figures.setdefault(method, {})[view.name] = figures
        pictures = {TRUTH: truth, **{method: image for method, (image, _) in made.items()}}
        if index == self.farthest:
            self.shown = view.name, {method: bytes_from_encoded(image) for method, image in pictures.items()}
        if isinstance(views, PlaneViews):
            self._keep_row(offset, pictures, judge)
        list(pool.map(lambda method: self.stacks[method].add(offset, pictures[method]), self.stacks))

    def _stacks(self) -> dict[str, FocalStack]:
        """Of each method's light field and of the true one; none where the views are no grid."""
        trial, photo = self.trial, self.given.photo
        if any(view.camera is not None for view in trial.scene.views):
            return {}
        offsets = [trial.offset(index) for index in trial.judged]
        foci = foci_of(offsets, self.given.judge.values)
        if foci and trial.given == trial.scene.centre:
            self.lens = read_lens_picture(trial.scene, self.options.max_pixels)
            through = self.lens and lens_focus(self.lens, offsets)
            foci += [through] if through else []
            if self.lens and not through:
                self.notes += ("The lens's picture is left out: it needs every view of its aperture.",)
        stacks = {method: FocalStack(foci) for method in (TRUTH, IDENTITY, REFERENCE, OURS) if foci}
        for stack in stacks.values():
            stack.add(ViewOffset(0.0, 0.0), photo)
        return stacks

    def _score_refocus(self) -> tuple[RefocusResult, ...]:
        if not self.stacks:
            return ()
        return score_methods(self.stacks, TRUTH, OURS, self.lens)

    def _reference_view(self, views: TrialViews, index: int) -> dict[str, tuple[FloatImage, float]]:
        start = time.perf_counter()
        colors = views.warp(self.disparity.values, index).colors
        return {REFERENCE: (quantise_as_stored(colors), 1e3 * (time.perf_counter() - start))}

    def _figures(
        self, image: FloatImage, truth: FloatImage, known: Mask | None, visible: Mask, hole: Mask, ms: float
    ) -> Figures:
        shown = image if known is None else np.where(known[..., None], image, truth)
        return Figures(
            bounded_psnr(image, truth, known),
            bounded_psnr(image, truth, visible),
            bounded_psnr(image, truth, hole),
            ssim(shown, truth, known),
            flip(shown, truth, known),
            math.nan if self.lpips is None else self.lpips(shown, truth),
            ms,
        )

    def _keep_row(self, offset: ViewOffset, pictures: Mapping[str, FloatImage], judge: WarpedView) -> None:
        """What EPIs need of a view in the given one's row."""
        if abs(offset.t) > SAME_ROW:
            return
        self.lines.append(LineView(offset.s, pictures[TRUTH], np.where(judge.hole, np.nan, judge.disparity)))
        for method, image in pictures.items():
            self.epis.setdefault(method, []).append((offset.s, image[self.epi_row]))

    def _epis(self) -> dict[str, Bytes]:
        epis: dict[str, Bytes] = {}
        for method, lines in self.epis.items():
            every = sorted([*lines, (0.0, self.given.photo[self.epi_row])], key=lambda line: line[0])
            if len(every) >= LEAST_EPI_VIEWS and method != IDENTITY:
                epis[method] = bytes_from_encoded(np.stack([line for _, line in every]))
        return epis

    def _consistency(self, views: PlaneViews) -> dict[str, Consistency]:
        found: dict[str, Consistency] = {}
        report_progress(1, 1, f"{self.trial.scene.name}: consistency")
        found[OURS] = consistency(views.made.view, views.offsets, self.given.photo, self.refined)
        if len(self.lines) + 1 >= LEAST_EPI_VIEWS:
            rms, off_px = line_straightness(self.given.photo, self.given.judge.values, self.lines)
            found[TRUTH] = Consistency(math.nan, math.nan, rms, off_px, 0)
        return found


def _row_to_show(disparity: FloatImage) -> int:
    """The row of pixels whose disparity varies most: its EPI crosses most edges."""
    return int(np.abs(np.diff(disparity, axis=1)).sum(axis=1).argmax()) if disparity.shape[1] > 1 else 0
