"""Depth by a trained model: a photo in, an estimate out whose type says what is known; kept, so that the same photo
costs nothing the second time.

Each kind of model has a file of its own, imported where it is used.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from iibr_core.color import photo_in_srgb
from iibr_core.depth.estimates import DisparityMap, Estimate, MetricDepth, RelativeInverseDepth
from iibr_core.depth.models import estimate_cache
from iibr_core.depth.models.catalog import ONNX, TRANSFORMERS, LocalModel
from iibr_core.depth.models.config import CONFIG, PREPROCESSOR
from iibr_core.depth.models.download import require_unchanged
from iibr_core.formats.files import is_folder
from iibr_core.runtime.machine import usual_budget_bytes
from iibr_core.runtime.tiling import ShouldStop, never
from iibr_core.types import ImageSize, InputError, Photo, ReportProgress, ignore_progress

PICKLED = ("*.bin", "*.pt", "*.pth", "*.ckpt")

Run = Callable[[Photo, ShouldStop, ReportProgress], Estimate]


def estimate_with(
    model: LocalModel,
    photo: Photo,
    memory_bytes: int | None = None,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
) -> Estimate:
    """What a model makes of a photo, at a size of the model's choosing; from the cache where it is there.

    memory_bytes: what the model may take; its input is made smaller for it. Raises InputError where the model cannot
    be used or its result is of no use, Cancelled where should_stop says so.
    """
    _require_weights(model)
    require_unchanged(model.folder)
    photo = photo_in_srgb(photo)
    report_progress(0, 0, f"looking for an earlier estimate by {model.title}")
    options, run = _prepared(model, photo.size, memory_bytes or usual_budget_bytes())
    files = (model.folder / CONFIG, model.folder / PREPROCESSOR, *model.weights)
    key = estimate_cache.key_of(photo.pixels, files, f"{model.package} {options}")
    found = estimate_cache.load(key)
    if found is None:
        found = run(photo, should_stop, report_progress)
        _require_use(model, found)
        estimate_cache.store(key, found)
    return found


def _prepared(model: LocalModel, size: ImageSize, memory_bytes: int) -> tuple[object, Run]:
    """What the estimate depends on beside the photo and the model, and what makes it. Raises InputError."""
    if model.package == ONNX:
        from iibr_core.depth.models import onnx_models

        onnx_input = onnx_models.input_for(model, size, memory_bytes)
        return onnx_input, partial(onnx_models.run_onnx, model, onnx_input)
    if model.package == TRANSFORMERS:
        from iibr_core.depth.models import transformers_models

        torch_input = transformers_models.input_for(model, size, memory_bytes)
        return torch_input, partial(transformers_models.run_transformers, model, torch_input)
    from iibr_core.depth.models.package_models import run_package

    return None, lambda photo, should_stop, report_progress: run_package(model, photo)


def _require_weights(model: LocalModel) -> None:
    """Raises InputError where a model has no weights that may be read, and says so of pickled ones."""
    folder = model.folder
    if not is_folder(folder):
        raise InputError(f"{folder}: no such folder")
    if model.weights:
        return
    pickled = [path.name for pattern in PICKLED for path in folder.glob(pattern)]
    if pickled:
        raise InputError(f"{folder}: {pickled[0]} is pickled, which can run code; only .safetensors weights are read")
    raise InputError(f"{folder}: holds no .safetensors or .onnx weights; get the whole model folder")


def _require_use(model: LocalModel, estimate: Estimate) -> None:
    """Raises InputError for results that say nothing about the photo."""
    match estimate:
        case RelativeInverseDepth(values) | MetricDepth(values) | DisparityMap(values):
            known = values if model.package in (ONNX, TRANSFORMERS) else values[~np.isnan(values)]
    if not known.size or not np.isfinite(known).all():
        raise InputError(f"{model.title} gave NaN or infinity for this photo")
    if isinstance(estimate, MetricDepth) and not (known > 0).all():
        raise InputError(f"{model.title} gave distances of 0 or less for this photo")
    if known.max() == known.min():
        raise InputError(f"{model.title} gave the same depth everywhere")
