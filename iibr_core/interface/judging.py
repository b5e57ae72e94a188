"""How far pictures are from true ones, and views from those of data sets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.evaluation import evaluate_scene
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.evaluation.metrics import flip, psnr, ssim
from iibr_core.evaluation.results import EvaluationResult
from iibr_core.interface.encoded_pictures import encoded
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import ReportProgress, ShouldStop, ignore_progress, never, stoppable, watched
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import InputError


@dataclass(frozen=True)
class Comparison:
    """How far a picture is from the true one: PSNR in dB, infinite for equal ones; SSIM, 1 for equal ones; FLIP, 0."""

    psnr_db: float
    ssim: float
    flip: float


def compare(picture: NDArray[Any], truth: NDArray[Any]) -> Comparison:
    """How far a picture (H, W, 3) is from the true one of the same shape; uint8, or float with 1 = white.

    Raises InputError where the shapes differ, or a package is missing: pip install 'iibr[evaluate]'.
    """
    if picture.shape != truth.shape or picture.ndim != 3:
        raise InputError(f"pictures of shapes {picture.shape} and {truth.shape} cannot be compared")
    require_extra("evaluate", "skimage", "flip_evaluator")
    one, other = encoded(picture), encoded(truth)
    return Comparison(psnr(one, other), ssim(one, other), flip(one, other))


def evaluate(
    folder: str | Path,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
    stages: Stages = ALL_STAGES,
    **options: Any,
) -> list[EvaluationResult]:
    """Judge views against those of a data set: a folder of one scene, or of several, as `iibr evaluate` takes it.

    stages: between map and view, that are on. options: other fields of `evaluate_scene.Options`. Raises InputError,
    and Cancelled once should_stop is true.
    """
    wanted = evaluate_scene.Options(stages=stages, **options)
    scenes = find_scenes(Path(folder))
    with stoppable(should_stop), watched(report_progress):
        return [one for scene in scenes for one in evaluate_scene.evaluate(scene, wanted)]
