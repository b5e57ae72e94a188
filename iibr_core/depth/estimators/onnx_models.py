"""Depth models as ONNX files, run by ONNX Runtime: no torch, one file of weights.

Layout and size of the input are read from the file. The JSON files beside it say how the photo is prepared, and
whether the output is depth or inverse depth; without them, both are as Depth Anything V2 has them.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.estimators.config import CONFIG, PREPROCESSOR, read_config, read_preparation
from iibr_core.depth.estimators.depth_estimator import Family, KnownModel, LocalModel, Run
from iibr_core.depth.estimators.onnx_file import depth_output, external_files, open_session, picture_input
from iibr_core.depth.estimators.preparation import Preparation, affordable_pixels, input_size, network_input
from iibr_core.formats.files import is_file, reason_of
from iibr_core.runtime.work import Cancelled, is_stopped, report_progress
from iibr_core.types import ImageSize, InputError, Photo

USUAL_PREPARATION = Preparation(ImageSize(518, 518), True, 14, False, (0.485, 0.456, 0.406), (0.229, 0.224, 0.225))
"""As Depth Anything V2 publishes it: for files without a preprocessor_config.json."""
KINDS = (None, "depth_anything", "dpt")
"""By the config's model type: those that give inverse depth, or say that they give metres."""
ACTIVATION_BYTES = 1500
"""For each pixel of the input; measured with Depth Anything V2 Small: 1,320 at 686x518, 1,900 at 980x518."""
USUAL_WEIGHT_BYTES = 99e6
"""Of that model. Activations grow with a network's width, weights with its square."""
BYTES = (0.0, 0.0, 0.0), (1 / 255, 1 / 255, 1 / 255)
"""Mean and deviation for networks that take 0..255."""
COMMON_MULTIPLE = 224
"""Multiple of the patches and strides in use, 14, 16 and 32 px: sides for networks that refuse multiples of 14."""
LOOK_S = 0.05
"""How often a running estimate looks whether it is still wanted."""


@dataclass(frozen=True)
class OnnxInput:
    """How a photo becomes the input of an ONNX model. is_metric: whether the model gives metres."""

    preparation: Preparation
    size: ImageSize
    is_metric: bool


def input_for(model: LocalModel, size: ImageSize, memory_bytes: int) -> OnnxInput:
    """The input for a photo of (height, width). Raises InputError where the memory is too small for any."""
    folder = model.folder
    is_told = is_file(folder / PREPROCESSOR)
    preparation = read_preparation(folder, USUAL_PREPARATION) if is_told else USUAL_PREPARATION
    is_metric = is_file(folder / CONFIG) and read_config(folder).get("depth_estimation_type") == "metric"
    least = (2 * preparation.multiple) ** 2
    per_pixel = ACTIVATION_BYTES * max(1, math.sqrt(model.weight_bytes / USUAL_WEIGHT_BYTES))
    pixels = affordable_pixels(model.title, model.weight_bytes, per_pixel, least, memory_bytes)
    return OnnxInput(preparation, input_size(preparation, size, pixels), is_metric)


def run_onnx(model: LocalModel, wanted: OnnxInput, photo: Photo) -> DepthEstimate:
    """Depth of a photo in sRGB, at the size of the model's output; non-finite values as they come.

    Raises InputError where the file is no depth model.
    """
    file = model.weights[0]
    report_progress(0, 0, f"loading {model.title}")
    session = open_session(file)
    taken = picture_input(session, file)
    preparation = replace(wanted.preparation, mean=BYTES[0], std=BYTES[1]) if taken.takes_bytes else wanted.preparation
    report_progress(0, 0, f"estimating depth with {model.title}")

    def outputs_at(size: ImageSize) -> dict[str, Any]:
        values = taken.arranged(network_input(photo.pixels, preparation, size))
        return _run(session, file, {taken.name: values})

    size = taken.size_for(wanted.size)
    try:
        outputs = outputs_at(size)
    except InputError:
        before, size = size, taken.size_for(_size_for_any(preparation, photo.size, wanted.size))
        if size == before:
            raise
        outputs = outputs_at(size)
    depth = depth_output(file, outputs, size)
    return DepthEstimate(depth, "metres" if wanted.is_metric else "inverse depth")


def _size_for_any(preparation: Preparation, size: ImageSize, wanted: ImageSize) -> ImageSize:
    """The size for networks that refuse `wanted`, not larger, for a photo of (height, width); `wanted` without any."""
    if math.prod(wanted) < (2 * COMMON_MULTIPLE) ** 2:
        return wanted
    return input_size(replace(preparation, multiple=COMMON_MULTIPLE), size, math.prod(wanted))


def _run(session: Any, file: Path, values: dict[str, Any]) -> dict[str, Any]:
    """All outputs by name. The session runs in a thread of its own, so that it can be stopped."""
    import onnxruntime

    options = onnxruntime.RunOptions()
    with ThreadPoolExecutor(1, "iibr-onnx") as thread:
        running = thread.submit(session.run, None, values, options)
        while not wait([running], LOOK_S).done:
            options.terminate = options.terminate or is_stopped()
    if options.terminate:
        raise Cancelled
    try:
        return dict(zip([each.name for each in session.get_outputs()], running.result()))
    except Exception as error:  # as above
        raise InputError(
            f"{file}: failed on this photo ({reason_of(error)}); if it needs pictures of other sizes, state size and"
            f" ensure_multiple_of in a {PREPROCESSOR} beside it"
        ) from error


def _accepts(path: Path) -> bool:
    """An ONNX file, or a folder with some whose output means what this family takes it for."""
    if is_file(path):
        return path.suffix.lower() == ".onnx"
    is_told = is_file(path / CONFIG)
    return bool(_files_in(path)) and (not is_told or read_config(path).get("model_type") in KINDS)


def _files_in(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.onnx")) + sorted(folder.glob("onnx/*.onnx"))


def weights_in(path: Path) -> tuple[Path, ...]:
    """The one ONNX file of a model's folder, `model.onnx` where there are several, and the files that hold its weights.

    Raises InputError where that leaves open which is meant, or one of those files is missing.
    """
    files = [path] if is_file(path) else _files_in(path)
    full = [file for file in files if file.name == "model.onnx"]
    if len(files) != 1 and len(full) != 1:
        names = ", ".join(file.name for file in files[:3]) or "none"
        raise InputError(f"{path}: which ONNX file is meant ({names})? Name it with --depth-model {path}/FILE.onnx")
    file = (full or files)[0]
    return file, *external_files(file)


def _prepare(model: LocalModel, size: ImageSize, memory_bytes: int) -> tuple[object, Run]:
    wanted = input_for(model, size, memory_bytes)
    return wanted, partial(run_onnx, model, wanted)


MODELS = (
    KnownModel(
        "depth-anything-v2-small",
        "Depth Anything V2 Small",
        "onnx-community/depth-anything-v2-small",
        "64fe43eba7f8a384b02fe3fadaa26cbba35548d8",
        99,
        "Apache-2.0",
        "any photo; the fastest",
        is_recommended=True,
    ),
    KnownModel(
        "depth-anything-v2-base",
        "Depth Anything V2 Base",
        "onnx-community/depth-anything-v2-base",
        "6db5e16b48d85e78c043e57f8411a23550edbbfc",
        389,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; finer shapes than Small, slower",
    ),
    KnownModel(
        "depth-anything-v2-large",
        "Depth Anything V2 Large",
        "onnx-community/depth-anything-v2-large",
        "e5476ff1183c8cfb19fcf293a5904c7403e77695",
        1340,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; the finest shapes of the three, the slowest",
    ),
)

FAMILY = Family(
    packages=("onnxruntime",),
    install="use Python 3.11 to 3.14, later ones have no package of it yet",
    fetched=(CONFIG, PREPROCESSOR, "onnx/model.onnx"),
    accepts=_accepts,
    weights_in=weights_in,
    prepare=_prepare,
    models=MODELS,
)
