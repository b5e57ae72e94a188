"""Depth by a trained model: a photo in, an estimate out whose type says what is known; kept, so that the same photo
costs nothing the second time.
"""

from __future__ import annotations

import time

import numpy as np

from iibr_core.color import photo_in_srgb
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.estimators import estimate_cache
from iibr_core.depth.estimators.config import CONFIG, PREPROCESSOR
from iibr_core.depth.estimators.depth_estimator import LocalModel
from iibr_core.depth.estimators.download import require_unchanged
from iibr_core.runtime.machine import free_memory_bytes
from iibr_core.runtime.work import report_progress
from iibr_core.types import InputError, Photo


def estimate_with(
    model: LocalModel,
    photo: Photo,
) -> DepthEstimate:
    """What a model makes of a photo, at a size of the model's choosing; from the cache where it is there.

    Its input is made smaller where memory is scarce. Raises InputError where the model cannot
    be used or its result is of no use.
    """
    require_unchanged(model.folder)
    photo = photo_in_srgb(photo)
    report_progress(0, 0, f"looking for an earlier estimate by {model.title}")
    options, run = model.family.prepare(model, photo.size, free_memory_bytes() // 2)
    files = (model.folder / CONFIG, model.folder / PREPROCESSOR, *model.weights)
    key = estimate_cache.key_of(photo.pixels, files, f"{model.family.packages[0]} {options}")
    found = estimate_cache.load(key)
    if found is None:
        begun_s = time.monotonic()
        found = run(photo)
        _require_use(model, found)
        estimate_cache.store(key, found)
        estimate_cache.store_seconds(model.title, time.monotonic() - begun_s)
    return found


def _require_use(model: LocalModel, estimate: DepthEstimate) -> None:
    """Raises InputError for results that say nothing about the photo."""
    values = estimate.values
    known = values[~np.isnan(values)] if model.family.leaves_gaps else values
    if not known.size or not np.isfinite(known).all():
        raise InputError(f"{model.title} gave NaN or infinity for this photo")
    if estimate.is_metric and not (known > 0).any():
        raise InputError(f"{model.title} gave no distance above 0 for this photo")
    if known.max() == known.min():
        raise InputError(f"{model.title} gave the same depth everywhere")
