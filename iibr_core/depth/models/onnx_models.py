"""Depth models as ONNX files, run by ONNX Runtime: no torch, one file of weights.

Name and size of the input are read from the file. The JSON files beside it say how the photo is prepared, and
whether the output is depth or inverse depth; without them, both are as Depth Anything V2 has them.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from iibr_core.depth.estimates import Estimate, MetricDepth, RelativeInverseDepth
from iibr_core.depth.models.catalog import LocalModel
from iibr_core.depth.models.config import CONFIG, PREPROCESSOR, read_config, read_preparation
from iibr_core.depth.models.preparation import Preparation, affordable_pixels, input_size, network_input
from iibr_core.formats.files import is_file
from iibr_core.runtime.machine import core_count
from iibr_core.runtime.tiling import Cancelled, ShouldStop
from iibr_core.types import ImageSize, InputError, Photo, ReportProgress

KIND = "depth_anything"
USUAL_PREPARATION = Preparation(ImageSize(518, 518), True, 14, False, (0.485, 0.456, 0.406), (0.229, 0.224, 0.225))
"""As Depth Anything V2 publishes it: for files without a preprocessor_config.json."""
ACTIVATION_BYTES = 1500
"""For each pixel of the input; measured with Depth Anything V2 Small: 1,320 at 686x518, 1,900 at 980x518."""
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
    preparation = read_preparation(folder, KIND) if is_file(folder / PREPROCESSOR) else USUAL_PREPARATION
    is_metric = is_file(folder / CONFIG) and read_config(folder).get("depth_estimation_type") == "metric"
    least = (2 * preparation.multiple) ** 2
    pixels = affordable_pixels(model.title, model.weight_bytes, ACTIVATION_BYTES, least, memory_bytes)
    return OnnxInput(preparation, input_size(preparation, size, pixels), is_metric)


def run_onnx(
    model: LocalModel, wanted: OnnxInput, photo: Photo, should_stop: ShouldStop, report_progress: ReportProgress
) -> Estimate:
    """Depth of a photo in sRGB, at the size of the model's output; non-finite values as they come.

    Raises InputError where the file is no depth model, Cancelled once should_stop is true.
    """
    file = _file_of(model)
    report_progress(0, 0, f"loading {model.title}")
    session = _open(file)
    name, size, number_type = _input_of(session, file)
    values = network_input(photo.pixels, wanted.preparation, size or wanted.size).astype(number_type)
    report_progress(0, 0, f"estimating depth with {model.title}")
    output = _run(session, file, {name: values}, should_stop)
    depth = np.asarray(output, np.float32)
    depth = depth[:, 0] if depth.ndim == 4 and depth.shape[1] == 1 else depth
    if depth.ndim != 3 or len(depth) != 1 or not depth.size:
        raise InputError(f"{file}: gives an array of shape {depth.shape}, not one map of depth; choose a depth model")
    return MetricDepth(depth[0]) if wanted.is_metric else RelativeInverseDepth(depth[0])


def _file_of(model: LocalModel) -> Path:
    assert model.file is not None
    return model.file


def _open(file: Path) -> Any:
    """A session for the file. Raises InputError where it is no ONNX model, or ONNX Runtime is not installed."""
    try:
        import onnxruntime
    except ImportError as error:
        raise InputError(
            f"{file}: running it needs ONNX Runtime, which has no package for this Python yet; use Python 3.11 to 3.14"
        ) from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = core_count()
    # Threads that spin while they wait would take the cores from the window.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
    except Exception as error:  # its errors share no class of their own
        raise InputError(f"{file}: is no ONNX model that can be run ({_line(error)}); get it again") from error


def _input_of(session: Any, file: Path) -> tuple[str, ImageSize | None, str]:
    """Name, (height, width) where the file fixes it, and number type of the one input."""
    inputs = session.get_inputs()
    if len(inputs) != 1 or len(inputs[0].shape) != 4 or inputs[0].type not in NUMBER_TYPES:
        told = ", ".join(f"{each.name} {each.shape} {each.type}" for each in inputs)[:160]
        raise InputError(f"{file}: does not take one picture (N, 3, H, W) but {told}; choose a depth model")
    height, width = inputs[0].shape[2:]
    is_fixed = isinstance(height, int) and isinstance(width, int)
    return inputs[0].name, ImageSize(height, width) if is_fixed else None, NUMBER_TYPES[inputs[0].type]


NUMBER_TYPES = {"tensor(float)": "float32", "tensor(float16)": "float16"}


def _run(session: Any, file: Path, values: dict[str, Any], should_stop: ShouldStop) -> Any:
    """The first output. The session runs in a thread of its own, so that it can be stopped."""
    import onnxruntime

    options = onnxruntime.RunOptions()
    with ThreadPoolExecutor(1, "iibr-onnx") as thread:
        running = thread.submit(session.run, None, values, options)
        while not wait([running], LOOK_S).done:
            options.terminate = options.terminate or should_stop()
    if options.terminate:
        raise Cancelled
    try:
        return running.result()[0]
    except Exception as error:  # as above
        raise InputError(f"{file}: failed on this photo ({_line(error)})") from error


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:160] or type(error).__name__
