"""Depth models that come as packages of their own (Depth Anything 3, UniDepth): thin adapters over their
documented calls. They are not part of this project's environment; a package that is not installed is told in one line.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np

from iibr_core.color import bytes_from_encoded
from iibr_core.depth.estimates import Estimate, MetricDepth, RelativeInverseDepth
from iibr_core.depth.models.catalog import LocalModel
from iibr_core.types import FloatImage, InputError, Photo

# What foreign packages raise for weights or photos that do not suit them.
FAILURES = (OSError, ValueError, RuntimeError, KeyError, TypeError, ImportError, AttributeError, AssertionError)


def run_package(model: LocalModel, photo: Photo) -> Estimate:
    """Depth from a package's model; NaN where it says nothing. Raises InputError where it cannot be used."""
    runs: dict[str, Callable[[LocalModel, Photo], Estimate]] = {
        "depth_anything_3": _depth_anything_3,
        "unidepth": _unidepth,
    }
    try:
        return runs[model.package](model, photo)
    except FAILURES as error:
        if isinstance(error, InputError):
            raise
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise InputError(f"{model.title} ({model.package}) failed: {reason}") from error


def _depth_anything_3(model: LocalModel, photo: Photo) -> RelativeInverseDepth:
    network = importlib.import_module("depth_anything_3.api").DepthAnything3.from_pretrained(str(model.folder))
    said = network.inference([bytes_from_encoded(photo.pixels)])
    # Its distances have no scale of their own.
    return RelativeInverseDepth(np.reciprocal(_positive(_array(said.depth)[0])))


def _unidepth(model: LocalModel, photo: Photo) -> MetricDepth:
    import torch

    network = importlib.import_module("unidepth.models").UniDepthV2.from_pretrained(str(model.folder)).eval()
    with torch.inference_mode():
        said = network.infer(torch.from_numpy(bytes_from_encoded(photo.pixels)).permute(2, 0, 1))
    return MetricDepth(_positive(_array(said["depth"]).squeeze()))


def _array(said: Any) -> FloatImage:
    return np.asarray(said.cpu() if hasattr(said, "cpu") else said, np.float32)


def _positive(depth: FloatImage) -> FloatImage:
    """Sky and the like is infinite or 0 there: unknown."""
    return np.where(np.isfinite(depth) & (depth > 0), depth, np.float32(np.nan))
