"""UniDepth, by its own package: a thin adapter over its documented call, for a folder of one's own."""

from __future__ import annotations

import importlib
from pathlib import Path

from iibr_core.color import bytes_from_encoded
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.estimators.config import mentions, safetensors_in
from iibr_core.depth.estimators.depth_estimator import Family, LocalModel
from iibr_core.depth.estimators.package_calls import positive, prepare_by
from iibr_core.formats.files import is_folder
from iibr_core.types import Photo


def _run(model: LocalModel, photo: Photo) -> DepthEstimate:
    import torch

    network = importlib.import_module("unidepth.models").UniDepthV2.from_pretrained(str(model.folder)).eval()
    with torch.inference_mode():
        said = network.infer(torch.from_numpy(bytes_from_encoded(photo.pixels)).permute(2, 0, 1))
    return DepthEstimate(positive(said["depth"]).squeeze(), "metres")


def _accepts(path: Path) -> bool:
    return is_folder(path) and mentions(path, "unidepth")


FAMILY = Family(
    packages=("unidepth", "torch"),
    install="follow github.com/lpiccinelli-eth/UniDepth",
    fetched=("*.json", "*.safetensors"),
    accepts=_accepts,
    weights_in=safetensors_in,
    prepare=prepare_by(_run),
    leaves_gaps=True,
)
