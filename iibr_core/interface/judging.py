"""Comparison of pictures with true ones, and of views with those of data sets."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored
from iibr_core.evaluation.evaluate import Options, Result
from iibr_core.evaluation.evaluate import evaluate as evaluate_scene
from iibr_core.evaluation.metrics import flip, psnr, ssim
from iibr_core.evaluation.scenes import find_scenes
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import ReportProgress, ShouldStop, ignore_progress, never, stoppable, watched
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import InputError


@dataclass(frozen=True)
class Comparison:
    """Distance of a picture from the true one: PSNR in dB, infinite for equal pictures; SSIM, then 1; FLIP, then 0."""

    psnr_db: float
    ssim: float
    flip: float


def compare(picture: NDArray[Any], truth: NDArray[Any]) -> Comparison:
    """Return how far a picture (H, W, 3) is from the true one of the same shape; uint8, or float with 1 = white.

    Raises InputError if the shapes differ, or a package is missing: pip install 'iibr[evaluate]'.
    """
    if picture.shape != truth.shape or picture.ndim != 3:
        raise InputError(f"pictures of shapes {picture.shape} and {truth.shape} cannot be compared")
    require_extra("evaluate", "skimage", "flip_evaluator")
    pair = encoded_from_stored(picture), encoded_from_stored(truth)
    return Comparison(psnr(*pair), ssim(*pair), flip(*pair))


def evaluate(
    folder: str | Path,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
    stages: Stages = ALL_STAGES,
    **options: Any,
) -> list[Result]:
    """Return the comparison of views with those of a data set: a folder of one scene, or of several.

    stages: stages between map and view that are on. options: other fields of `iibr_core.evaluation.evaluate.Options`.
    Raises InputError, and Cancelled once should_stop is true.
    """
    choices = Options(stages=stages, **options)
    with stoppable(should_stop), watched(report_progress):
        return [result for scene in find_scenes(Path(folder)) for result in evaluate_scene(scene, choices)]
