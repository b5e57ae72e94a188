"""The depth models of the paper's comparison that torch runs, from a folder of safetensors weights.

MiDaS (DPT), ZoeDepth, Depth Pro and Depth Anything by transformers, UniDepth by its own package. All of them are
imported where they are used: they take seconds.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from iibr_core.color import bytes_from_encoded
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.models.preparation import CONFIG, Preparation, network_input, read_object, read_preparation
from iibr_core.formats.files import printable, reason_of
from iibr_core.runtime.machine import core_count
from iibr_core.runtime.work import Cancelled, raise_if_stopped, report_progress
from iibr_core.types import ImageSize, InputError, Photo, image_size

PREPARATIONS = {
    kind: Preparation(ImageSize(*size), keeps_aspect, multiple, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5))
    for kind, size, keeps_aspect, multiple in (
        ("depth_anything", (518, 518), True, 14),
        ("depth_pro", (1536, 1536), False, 1),
        ("dpt", (384, 384), False, 1),
        ("zoedepth", (384, 512), True, 32),
    )
}
"""The preparations of transformers, by the config's model type, for what a folder leaves out."""


def safetensors_in(folder: Path) -> tuple[Path, ...]:
    """Return the files of weights in a folder. Raises InputError if there are none: pickles can run code."""
    weights = tuple(sorted(folder.glob("*.safetensors")))
    if not weights:
        raise InputError(f"{folder}: holds no .safetensors or .onnx weights, and pickled ones are not read; get those")
    return weights


def estimate_transformers(folder: Path, title: str, photo: Photo) -> DepthEstimate:
    """Return the depth of a photo in sRGB at the size of the network's output; non-finite values as they come.

    title: for progress. Raises InputError if the folder holds something else than a depth model.
    """
    report_progress(0, 0, f"loading {title}")
    import torch

    from iibr_core.formats.maps.resample import resample_surfaces

    config = read_object(folder / CONFIG)
    kind, (height, width) = config["model_type"], photo.size
    # ZoeDepth was trained with mirrored borders.
    rows, columns = (int(math.sqrt(side / 2) * 3) if kind == "zoedepth" else 0 for side in photo.size)
    pixels = np.pad(photo.pixels, ((rows, rows), (columns, columns), (0, 0)), "reflect")
    preparation = read_preparation(folder, PREPARATIONS[kind])
    values = network_input(pixels, preparation, preparation.size_for(image_size(pixels)))
    with _as_input_errors(folder, title):
        network = _load_network(folder, config)
        torch.set_num_threads(min(torch.get_num_threads(), core_count()))
        device = "cuda" if torch.cuda.is_available() else "cpu"
        with torch.inference_mode(), _layers_watched(network, f"estimating depth with {title}"):
            output = network.to(device)(pixel_values=torch.from_numpy(values).to(device))
        depth = output.predicted_depth[0].float().cpu().numpy()
    if kind == "zoedepth":
        whole = resample_surfaces(depth, image_size(pixels))
        return DepthEstimate(whole[rows : rows + height, columns : columns + width], "metres")
    if kind == "depth_pro" and output.field_of_view is not None:
        # It gives inverse distance for a camera whose focal length is the picture's width; its authors clamp it.
        widths = 0.5 / math.tan(math.radians(float(output.field_of_view[0])) / 2)
        return DepthEstimate(1 / np.clip(depth / np.float32(widths), 1e-4, 1e4), "metres")
    is_metric = kind == "depth_anything" and config.get("depth_estimation_type") == "metric"
    return DepthEstimate(depth, "metres" if is_metric else "inverse depth")


def estimate_unidepth(folder: Path, title: str, photo: Photo) -> DepthEstimate:
    """Return the distances of a photo in sRGB by UniDepth's own package, NaN where they are not positive.

    Raises InputError if the folder holds something else.
    """
    report_progress(0, 0, f"estimating depth with {title}")
    import torch

    with _as_input_errors(folder, title), torch.inference_mode():
        network = importlib.import_module("unidepth.models").UniDepthV2.from_pretrained(str(folder)).eval()
        output = network.infer(torch.from_numpy(bytes_from_encoded(photo.pixels)).permute(2, 0, 1))
        depth = output["depth"].squeeze().float().cpu().numpy()
    return DepthEstimate(np.where(np.isfinite(depth) & (depth > 0), depth, np.float32(np.nan)), "metres")


def _load_network(folder: Path, config: dict[str, Any]) -> Any:
    from transformers import AutoModelForDepthEstimation
    from transformers.utils import logging

    for part in (config, config.get("backbone_config") or {}):
        if backbone := part.get("backbone"):  # it would be downloaded
            raise InputError(f"{folder / CONFIG}: needs another model, {printable(backbone)}; get a whole folder")
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    network, report = AutoModelForDepthEstimation.from_pretrained(
        folder, local_files_only=True, use_safetensors=True, trust_remote_code=False, output_loading_info=True
    )
    if report["missing_keys"]:
        raise InputError(f"{folder}: its weights lack {len(report['missing_keys'])} parts; get all of its files")
    return network.float().eval()


@contextmanager
def _as_input_errors(folder: Path, title: str) -> Iterator[None]:
    """Raise InputError for whatever torch and its packages raise for weights or photos that do not suit them."""
    try:
        yield
    except (Cancelled, InputError):
        raise
    except Exception as error:
        raise InputError(f"{folder}: {title} cannot be used ({reason_of(error)}); get it again") from error


@contextmanager
def _layers_watched(network: Any, doing: str) -> Iterator[None]:
    """Report progress before each layer of a network, and stop there."""
    layers = [layer for layer in network.modules() if not any(layer.children())]
    count = 0

    def before(*_: object) -> None:
        nonlocal count
        raise_if_stopped()
        count = min(count + 1, len(layers))  # some layers run twice
        report_progress(count, len(layers), doing)

    hooks = [layer.register_forward_pre_hook(before) for layer in layers]
    try:
        yield
    finally:
        for hook in hooks:
            hook.remove()
