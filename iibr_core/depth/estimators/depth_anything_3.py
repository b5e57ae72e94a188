"""Depth Anything 3, by its own package: a thin adapter over its documented call."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np

from iibr_core.color import bytes_from_encoded
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.estimators.config import mentions, safetensors_in
from iibr_core.depth.estimators.depth_estimator import Family, KnownModel, LocalModel
from iibr_core.depth.estimators.package_calls import positive, prepare_by
from iibr_core.formats.files import is_folder
from iibr_core.types import Photo


def _run(model: LocalModel, photo: Photo) -> DepthEstimate:
    network = importlib.import_module("depth_anything_3.api").DepthAnything3.from_pretrained(str(model.folder))
    said = network.inference([bytes_from_encoded(photo.pixels)])
    # Its distances have no scale of their own.
    return DepthEstimate(np.reciprocal(positive(said.depth)[0]), "inverse depth")


def _accepts(path: Path) -> bool:
    return is_folder(path) and mentions(path, "da3", "depth_anything_3")


FAMILY = Family(
    packages=("depth_anything_3", "torch"),
    install="pip install depth-anything-3",
    fetched=("*.json", "*.safetensors"),
    accepts=_accepts,
    weights_in=safetensors_in,
    prepare=prepare_by(_run),
    models=(
        KnownModel(
            "depth-anything-3-small",
            "Depth Anything 3 Small",
            "depth-anything/DA3-SMALL",
            "e08cab65ca0ec38e7826075418411ab90cab4da3",
            138,
            "Apache-2.0",
            "any photo; newer than V2, with its authors' package",
        ),
    ),
    leaves_gaps=True,
)
