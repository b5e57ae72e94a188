"""Depth models as ONNX files, run by ONNX Runtime on whichever processor it finds: no torch.

Layout and size of the picture are read from the file. The JSON files beside it state how the photo is prepared and
whether the output is distances; without them, the photo is prepared as for Depth Anything V2. Models that also take a
number of tokens give a map of points, as MoGe does.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.models.points import FAR, depth_of_points
from iibr_core.depth.models.preparation import (
    CONFIG,
    PLAIN_COLORS,
    PREPROCESSOR,
    USUAL_PREPARATION,
    Preparation,
    network_input,
    read_object,
    read_preparation,
)
from iibr_core.formats.files import printable, reason_of, stays_within
from iibr_core.runtime.machine import core_count
from iibr_core.runtime.work import Cancelled, report_progress, wait_unless_stopped
from iibr_core.types import FloatImage, ImageSize, InputError, Photo

ACCELERATORS = ("CUDAExecutionProvider", "CoreMLExecutionProvider", "DmlExecutionProvider")
NUMBER_TYPES = {"tensor(float)": "float32", "tensor(float16)": "float16", "tensor(uint8)": "uint8"}
"""Number types of pictures, by ONNX Runtime's names for them."""
EXTERNAL_FILE = re.compile(rb"\n\x08location\x12(.)", re.DOTALL)
"""Start of a tensor's entry about its file of numbers; the last byte is the length of the file's name (onnx.proto)."""
DEPTH_NAME = re.compile("depth|disp|dist", re.IGNORECASE)
OTHER_NAME = re.compile("conf|feature|mask|normal|prob|seg|sky|std|var|uncert|weight", re.IGNORECASE)
"""Names of outputs that are no depth, whatever their shape."""
METRIC_NAME = re.compile("metric|focal|normal|intrinsic", re.IGNORECASE)
"""Names of outputs of metric models: Depth Pro's focal length, Metric3D's normals, UniDepth's camera."""
SCALE_NAMES = "scale", "metric_scale"
"""Names of the factor from a map of points to metres: that of MoGe's published files, and that of its code."""
PATCH_PX = 14
"""Side of the patch of one token, in pixels."""


@dataclass(frozen=True)
class PictureInput:
    """The input of an ONNX model: a picture.

    name: in the file. height, width: in pixels, None if any will do. channel_axis: index of the 3 channels among `rank`
    axes. number_type: numpy's name for it; bytes are 0..255 and not normalised. tokens: name and shape of a second
    input, the number of patches of the picture; None without.
    """

    name: str
    height: int | None
    width: int | None
    channel_axis: int
    rank: int
    number_type: str
    tokens: tuple[str, tuple[int, ...]] | None = None

    def prepare(self, pixels: FloatImage, preparation: Preparation, size: ImageSize) -> np.ndarray[Any, Any]:
        """Return a photo's pixels (H, W, 3), 0..1, as the model takes them."""
        if self.number_type == "uint8":
            preparation = replace(preparation, mean=(0.0,) * 3, std=(1 / 255,) * 3)
        planes = network_input(pixels, preparation, size)
        if self.number_type == "uint8":
            planes = np.clip(np.rint(planes), 0, 255)
        values = np.moveaxis(planes if self.rank == 4 else planes[0], self.rank - 3, self.channel_axis)
        return np.ascontiguousarray(values, self.number_type)


def estimate_onnx(
    file: Path, settings: Path, title: str, photo: Photo, usual: Preparation = USUAL_PREPARATION
) -> DepthEstimate:
    """Return the depth of a photo in sRGB at the size of the model's output; non-finite values as they come.

    settings: the folder of the JSON files. title: for progress. usual: preparation without such files. Raises
    InputError if the file is no depth model.
    """
    report_progress(0, 0, f"loading {title}")
    import onnxruntime

    available = onnxruntime.get_available_providers()
    if accelerators := [name for name in ACCELERATORS if name in available]:
        with suppress(InputError):  # the driver is missing, or cannot run this network
            return _estimate(open_session(file, *accelerators), file, settings, title, photo, usual)
    return _estimate(open_session(file), file, settings, title, photo, usual)


def _estimate(session: Any, file: Path, settings: Path, title: str, photo: Photo, usual: Preparation) -> DepthEstimate:
    picture = picture_input(session, file)
    preparation = read_preparation(settings, usual if picture.tokens is None else PLAIN_COLORS)
    report_progress(0, 0, f"estimating depth with {title}")
    failures = []
    for multiple in (preparation.multiple, 32):  # some networks refuse multiples of 14
        wanted = replace(preparation, multiple=multiple).size_for(photo.size)
        size = ImageSize(picture.height or wanted.height, picture.width or wanted.width)
        try:
            given = {picture.name: picture.prepare(photo.pixels, preparation, size)}
            if picture.tokens is not None:
                name, shape = picture.tokens
                given[name] = np.full(shape, round(size.height * size.width / PATCH_PX**2), np.int64)
            outputs = _run(session, given)
        except RuntimeError as error:
            failures.append(reason_of(error))
            continue
        if (points := outputs.get("points")) is not None and np.shape(points)[-1:] == (3,):
            scale = next((float(np.ravel(outputs[name])[0]) for name in SCALE_NAMES if name in outputs), None)
            return depth_of_points(np.squeeze(points, 0), beyond_mask(outputs), scale)
        is_metric = read_object(settings / CONFIG).get("depth_estimation_type") == "metric"
        is_metric |= any(map(METRIC_NAME.search, outputs))
        values = depth_output(file, outputs, size)
        if not is_metric:
            return DepthEstimate(values, "inverse depth")
        beyond = beyond_mask(outputs)
        if beyond is not None and beyond.shape == values.shape:
            values = np.where(beyond, np.float32(FAR), values)
        return DepthEstimate(values, "metres", _focal_ratio(outputs, size))
    raise InputError(
        f"{file}: failed on this photo ({failures[0]}); if it needs pictures of other sizes, state size and"
        f" ensure_multiple_of in a {PREPROCESSOR} beside it"
    )


def open_session(file: Path, *accelerators: str) -> Any:
    """Return an ONNX Runtime session. Raises InputError if the file is no ONNX model."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = core_count()
    # Threads that spin while they wait would take the cores from the window.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(str(file), options, providers=[*accelerators, "CPUExecutionProvider"])
    except Exception as error:  # its errors share no class
        raise InputError(f"{file}: is not an ONNX model that can be run ({reason_of(error)}); get it again") from error


def picture_input(session: Any, file: Path) -> PictureInput:
    """Return the input of a model that takes one picture. Raises InputError if it takes something else."""
    inputs = session.get_inputs()
    tokens = next(((each.name, tuple(each.shape)) for each in inputs if each.name == "num_tokens"), None)
    inputs = [each for each in inputs if each.name != "num_tokens"]
    shape = inputs[0].shape if inputs else []
    first = len(shape) - 3
    is_picture = len(inputs) == 1 and first in (0, 1) and inputs[0].type in NUMBER_TYPES
    axes = [axis for axis in (first, len(shape) - 1) if is_picture and shape[axis] == 3]
    if is_picture and not axes and not isinstance(shape[first], int):
        axes = [first]
    if not axes:
        listed = ", ".join(f"{value.name} {value.shape} {value.type}" for value in inputs)[:160]
        raise InputError(
            f"{file}: takes {listed}, not one picture (N, 3, H, W) or (N, H, W, 3) of floats or bytes;"
            " export the model with such an input alone"
        )
    sides = [shape[axis] for axis in range(first, len(shape)) if axis != axes[0]]
    height, width = (side if isinstance(side, int) and side > 0 else None for side in sides)
    return PictureInput(inputs[0].name, height, width, axes[0], len(shape), NUMBER_TYPES[inputs[0].type], tokens)


def depth_output(file: Path, outputs: Mapping[str, Any], size: ImageSize) -> FloatImage:
    """Return the map (h, w) float32 among a model's outputs: by its name, else the largest, else the first.

    outputs: arrays by name. size: of the picture that the model was given. Raises InputError if no output is a map.
    """
    maps = [(name, np.squeeze(values)) for name, values in outputs.items() if _is_map(name, values, size)]
    if not maps:
        shapes = ", ".join(f"{name} {getattr(values, 'shape', 'a list')}" for name, values in outputs.items())
        raise InputError(f"{file}: gives {shapes[:160]}, not one map of depth (H, W); choose a depth model")
    _, values = min(maps, key=lambda named: (not DEPTH_NAME.search(named[0]), -named[1].size))
    return np.asarray(values, np.float32)


def beyond_mask(outputs: Mapping[str, Any]) -> NDArray[np.bool_] | None:
    """Return where nothing has a distance, such as the sky, (h, w), by a model's outputs `mask` or `sky`; else None."""
    for name, is_far in (("mask", False), ("sky", True)):
        if name in outputs and np.squeeze(outputs[name]).ndim == 2:
            return np.asarray((np.squeeze(outputs[name]) > 0.5) == is_far)
    return None


def _focal_ratio(outputs: Mapping[str, Any], size: ImageSize) -> float | None:
    """Return the focal length that a model gives for a picture of this size in px, in widths of it; None without."""
    lengths = [float(np.ravel(value)[0]) for name, value in outputs.items() if "focal" in name.lower()]
    return lengths[0] / size.width if lengths and np.isfinite(lengths[0]) and lengths[0] > 0 else None


def external_files(file: Path) -> tuple[Path, ...]:
    """Return the files beside an ONNX file that hold its weights. Raises InputError if one is missing or elsewhere."""
    if file.stat().st_size > 64 * 2**20:  # it holds its weights itself
        return ()
    content = file.read_bytes()
    ends = [(match.end(), match[1][0]) for match in EXTERNAL_FILE.finditer(content)]
    names = sorted({content[end : end + length].decode("utf-8", "replace") for end, length in ends})
    for name in names:
        if not stays_within(name) or not (file.parent / name).is_file():
            raise InputError(f"{file}: its weights are in {printable(name)}, which does not lie beside it; get it, too")
    return tuple(file.parent / name for name in names)


def _run(session: Any, pictures: Mapping[str, Any]) -> dict[str, Any]:
    """Return all outputs by name; the network runs in a thread, so that it can be stopped. Raises RuntimeError."""
    import onnxruntime

    options = onnxruntime.RunOptions()
    with ThreadPoolExecutor(1, "iibr-onnx") as thread:
        try:
            values = wait_unless_stopped(thread.submit(session.run, None, pictures, options))
        except Cancelled:
            options.terminate = True
            raise
        except Exception as error:  # its errors share no class
            raise RuntimeError(reason_of(error)) from error
    return dict(zip((output.name for output in session.get_outputs()), values))


def _is_map(name: str, values: Any, size: ImageSize) -> bool:
    """Return whether an output has nearly the aspect of a picture of this size, as lists of features do not."""
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu" or OTHER_NAME.search(name):
        return False
    sides = [side for side in values.shape if side != 1]
    if len(sides) != 2 or min(sides) < 8:  # smaller outputs are matrices
        return False
    return bool(0.8 <= sides[1] / sides[0] * size.height / size.width <= 1.25)
