"""Depth models that the library transformers runs, from a folder of safetensors weights.

torch and transformers are imported where they are used: a photo with depth of its own never waits for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.estimators.config import read_config, read_preparation, safetensors_in
from iibr_core.depth.estimators.depth_estimator import Family, KnownModel, LocalModel, Run
from iibr_core.depth.estimators.preparation import Preparation, affordable_pixels, input_size, network_input
from iibr_core.formats.files import is_folder, reason_of
from iibr_core.runtime.machine import core_count
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.types import (
    FloatImage,
    ImageSize,
    InputError,
    Photo,
    image_size,
)

if TYPE_CHECKING:
    import torch

ACTIVATION_BYTES = 1500
"""For each pixel of the input of a model of USUAL_WIDTH; measured: 1,060 with Depth Anything V2 Small at 686x518."""
USUAL_WIDTH = 384

INVERSE_LIMITS = (1e-4, 1e4)
"""Depth Pro's canonical inverse depth, as its authors clamp it."""

HALF = (0.5, 0.5, 0.5)
KINDS = {
    "depth_anything": Preparation(ImageSize(518, 518), True, 14, False, HALF, HALF),
    "depth_pro": Preparation(ImageSize(1536, 1536), False, 1, False, HALF, HALF),
    "dpt": Preparation(ImageSize(384, 384), False, 1, False, HALF, HALF),
    "zoedepth": Preparation(ImageSize(384, 512), True, 32, True, HALF, HALF),
}
"""By the config's model type: the library's own preparation where the folder leaves a value out."""

# What transformers and torch raise for folders that hold something else than they claim.
LOAD_ERRORS = (
    OSError,
    ValueError,
    RuntimeError,
    KeyError,
    TypeError,
    ImportError,
    AttributeError,
    AssertionError,
)


@dataclass(frozen=True)
class TransformersInput:
    """How a photo becomes a model's input, and of which (height, width)."""

    preparation: Preparation
    size: ImageSize


def input_for(model: LocalModel, size: ImageSize, memory_bytes: int) -> TransformersInput:
    """The input for a photo of (height, width) that the memory allows. Raises InputError where it allows none."""
    config = read_config(model.folder)
    preparation = read_preparation(model.folder, KINDS[config["model_type"]])
    per_pixel = ACTIVATION_BYTES * max(_width_of(config), USUAL_WIDTH) / USUAL_WIDTH
    is_fixed = config["model_type"] == "depth_pro"
    least = preparation.size.height * preparation.size.width if is_fixed else (2 * preparation.multiple) ** 2
    pixels = affordable_pixels(model.title, model.weight_bytes, per_pixel, least, memory_bytes)
    return TransformersInput(preparation, preparation.size if is_fixed else input_size(preparation, size, pixels))


def _width_of(config: dict[str, Any]) -> int:
    """Channels of the transformer inside; what is not told counts as large."""
    backbone = config.get("backbone_config")
    inner = backbone if isinstance(backbone, dict) else config
    width = inner.get("hidden_size", 1024)
    return width if isinstance(width, int) and width > 0 else 1024


def run_transformers(model: LocalModel, wanted: TransformersInput, photo: Photo) -> DepthEstimate:
    """Depth of a photo in sRGB, at the size of the model's output; non-finite values as they come.

    Raises InputError where the folder holds something else than a depth model.
    """
    report_progress(0, 0, f"loading {model.title}")
    import torch

    network = _load_network(model)
    torch.set_num_threads(min(torch.get_num_threads(), core_count()))
    device = "cuda" if torch.cuda.is_available() else "cpu"
    pixels = _network_tensor(photo.pixels, wanted).to(device)
    doing = f"estimating depth with {model.title}"
    try:
        with torch.inference_mode(), _LayerProgress(network, doing):
            output = network.to(device)(pixel_values=pixels)
    except (RuntimeError, ValueError, IndexError, TypeError) as error:
        raise InputError(f"{model.title} failed on this photo ({reason_of(error)})") from error
    return _estimate_of(network.config, output, photo.size, wanted.preparation)


def _load_network(model: LocalModel) -> Any:
    """The network, ready to run. Raises InputError where the folder holds something else."""
    from safetensors import SafetensorError
    from transformers import AutoModelForDepthEstimation
    from transformers.utils import logging

    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        network, report = AutoModelForDepthEstimation.from_pretrained(
            model.folder, local_files_only=True, use_safetensors=True, trust_remote_code=False, output_loading_info=True
        )
    except (*LOAD_ERRORS, SafetensorError) as error:
        raise InputError(f"{model.folder}: cannot be loaded as a depth model ({reason_of(error)})") from error
    lacking = sorted(report["missing_keys"])
    if lacking:
        raise InputError(f"{model.folder}: its weights lack {len(lacking)} parts ({lacking[0]}, ...); get them all")
    return network.float().eval()


class _LayerProgress:
    """While it is entered, a network asks before each of its layers whether to go on, and tells how far it is."""

    def __init__(self, network: torch.nn.Module, doing: str) -> None:
        self._layers = [layer for layer in network.modules() if not any(layer.children())]
        self._doing = doing
        self._seen = 0

    def __enter__(self) -> None:
        self._hooks = [layer.register_forward_pre_hook(self._before) for layer in self._layers]

    def __exit__(self, *_: object) -> None:
        for hook in self._hooks:
            hook.remove()

    def _before(self, *_: object) -> None:
        raise_if_stopped()
        self._seen += 1
        # A layer that runs twice must not make it more than all.
        report_progress(min(self._seen, len(self._layers)), len(self._layers), self._doing)


def _network_tensor(pixels: FloatImage, wanted: TransformersInput) -> torch.Tensor:
    """(1, 3, height, width), prepared as the model was trained."""
    import torch

    if wanted.preparation.pads:
        pad_y, pad_x = _padding(image_size(pixels))
        pixels = np.pad(pixels, ((pad_y, pad_y), (pad_x, pad_x), (0, 0)), "reflect")
    return torch.from_numpy(network_input(pixels, wanted.preparation, wanted.size))


def _padding(size: ImageSize) -> tuple[int, int]:
    """ZoeDepth's borders, rows and columns: it was trained with them."""
    return int(math.sqrt(size.height / 2) * 3), int(math.sqrt(size.width / 2) * 3)


def _estimate_of(config: Any, output: Any, size: ImageSize, preparation: Preparation) -> DepthEstimate:
    """The network's output as what it is; by the kind of network, never by its values. size: of the photo."""
    values = output.predicted_depth[0].float().cpu().numpy()
    match config.model_type:
        case "zoedepth":
            return DepthEstimate(_remove_padding(values, size) if preparation.pads else values, "metres")
        case "depth_pro":
            return _depth_pro_estimate(values, output.field_of_view)
        case "depth_anything" if config.depth_estimation_type == "metric":
            return DepthEstimate(values, "metres")
        case _:
            return DepthEstimate(values, "inverse depth")


def _remove_padding(values: FloatImage, size: ImageSize) -> FloatImage:
    from iibr_core.formats.maps.resample import resample_surfaces

    pad_y, pad_x = _padding(size)
    whole = resample_surfaces(values, ImageSize(size.height + 2 * pad_y, size.width + 2 * pad_x))
    return whole[pad_y : pad_y + size.height, pad_x : pad_x + size.width]


def _depth_pro_estimate(canonical: FloatImage, field_of_view: Any) -> DepthEstimate:
    """Depth Pro tells inverse distance for a camera as wide as its picture; its field of view turns that to metres."""
    if field_of_view is None:
        return DepthEstimate(canonical, "inverse depth")
    width = canonical.shape[1]
    focal_px = width / 2 / math.tan(math.radians(float(field_of_view[0])) / 2)
    return DepthEstimate(1 / np.clip(canonical * np.float32(width / focal_px), *INVERSE_LIMITS), "metres")


def _accepts(path: Path) -> bool:
    return is_folder(path) and read_config(path).get("model_type") in KINDS


def _prepare(model: LocalModel, size: ImageSize, memory_bytes: int) -> tuple[object, Run]:
    wanted = input_for(model, size, memory_bytes)
    return wanted, partial(run_transformers, model, wanted)


MODELS = (
    KnownModel(
        "depth-anything-v2-metric-indoor",
        "Depth Anything V2 Metric Indoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Indoor-Small-hf",
        "8078d68a9c75a972131914f6afd0c1723be0da7f",
        99,
        "Apache-2.0",
        "rooms, where distances in metres matter",
    ),
    KnownModel(
        "depth-anything-v2-metric-outdoor",
        "Depth Anything V2 Metric Outdoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Outdoor-Small-hf",
        "fd2c22027eaf20374204f14099b8341e1925ad39",
        99,
        "Apache-2.0",
        "streets and landscapes, where distances in metres matter",
    ),
    KnownModel(
        "depth-pro",
        "Depth Pro",
        "apple/DepthPro-hf",
        "de816c8ce7168afcb231f96d501d72b869d0beda",
        1904,
        "Apple's model licence (for research)",
        "sharp outlines such as hair, and distances in metres; slow",
    ),
    KnownModel(
        "zoedepth",
        "ZoeDepth",
        "Intel/zoedepth-nyu-kitti",
        "f364d4c7936e91f465abba182208dd68142bf0ca",
        1380,
        "MIT",
        "distances in metres, indoors and on streets, under a free licence",
    ),
    KnownModel(
        "midas-dpt-large",
        "MiDaS 3 (DPT large)",
        "Intel/dpt-large",
        "bc15f29aa3a80d532f2ed650b5e16ac48d8958f9",
        1370,
        "Apache-2.0",
        "comparing with older work",
    ),
)

FAMILY = Family(
    packages=("transformers", "torch"),
    install="pip install 'iibr[depth]'",
    fetched=("*.json", "*.safetensors"),
    accepts=_accepts,
    weights_in=safetensors_in,
    prepare=_prepare,
    models=MODELS,
)
