"""Reads what an ONNX file takes and gives: the layout of its picture, the map among its outputs, files of weights."""

from __future__ import annotations

import mmap
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from iibr_core.formats.files import is_file, printable, reason_of, stays_within
from iibr_core.runtime.machine import core_count
from iibr_core.types import FloatImage, ImageSize, InputError

NUMBER_TYPES = {
    "tensor(float)": "float32",
    "tensor(float16)": "float16",
    "tensor(double)": "float64",
    "tensor(uint8)": "uint8",
}
"""Number types of pictures that are made, by ONNX Runtime's names for them."""
CHANNELS = 3
EXTERNAL_FILE = re.compile(rb"\n\x08location\x12(.)", re.DOTALL)
"""Start of the entry of a tensor whose numbers are in another file; its last byte is the length of the file's name
(onnx.proto, TensorProto.external_data).
"""
MAX_GRAPH_BYTES = 64 * 2**20
"""Larger ONNX files hold their weights themselves: they are not searched for names of others."""
DEPTH_WORDS = ("depth", "disp", "dist")
"""Parts of the names of outputs that are maps of depth."""
OTHER_WORDS = ("conf", "feature", "mask", "normal", "prob", "seg", "sky", "std", "var", "uncert", "weight")
"""Parts of the names of outputs that are no depth, whatever their shape."""
MIN_MAP_SIDE = 8
"""Least height and width of a map, in pixels: smaller outputs are matrices, of a camera for example."""
MAX_ASPECT_CHANGE = 1.25
"""Most that the aspects of a picture and its map differ by: outputs of other shapes are lists of features."""


@dataclass(frozen=True)
class PictureInput:
    """The one input of an ONNX model: a picture.

    name: in the file. height, width: in pixels, None where any will do. channel_axis: place of the 3 channels among
    `rank` axes. number_type: numpy's name for it.
    """

    name: str
    height: int | None
    width: int | None
    channel_axis: int
    rank: int
    number_type: str

    @property
    def takes_bytes(self) -> bool:
        """Whether the picture is 0..255, not normalised."""
        return self.number_type == "uint8"

    def size_for(self, wanted: ImageSize) -> ImageSize:
        """The size that is fed, where `wanted` is what suits the photo."""
        return ImageSize(self.height or wanted.height, self.width or wanted.width)

    def arranged(self, planes: FloatImage) -> np.ndarray[Any, Any]:
        """A picture (1, 3, H, W) with the axes and the numbers of the file."""
        values = planes if self.rank == 4 else planes[0]
        values = np.moveaxis(values, self.rank - 3, self.channel_axis)
        if self.takes_bytes:
            values = np.clip(np.rint(values), 0, 255)
        return np.ascontiguousarray(values, self.number_type)


def open_session(file: Path) -> Any:
    """An ONNX Runtime session. Raises InputError where the file is no ONNX model, or ONNX Runtime is not installed."""
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
        raise InputError(f"{file}: is not an ONNX model that can be run ({reason_of(error)}); get it again") from error


def picture_input(session: Any, file: Path) -> PictureInput:
    """The input of a model that takes one picture. Raises InputError where it takes something else."""
    inputs = session.get_inputs()
    shape = inputs[0].shape if inputs else []
    axis = _channel_axis(shape)
    if len(inputs) != 1 or axis is None or inputs[0].type not in NUMBER_TYPES:
        listed = ", ".join(f"{each.name} {each.shape} {each.type}" for each in inputs)[:160]
        raise InputError(
            f"{file}: takes {listed}, not one picture (N, 3, H, W) or (N, H, W, 3) of floats or bytes;"
            " export the model with such an input alone"
        )
    sides = [side for place, side in enumerate(shape) if place >= len(shape) - 3 and place != axis]
    height, width = (side if isinstance(side, int) and side > 0 else None for side in sides)
    return PictureInput(inputs[0].name, height, width, axis, len(shape), NUMBER_TYPES[inputs[0].type])


def depth_output(file: Path, outputs: Mapping[str, Any], size: ImageSize) -> FloatImage:
    """The map (h, w) float32 among a model's outputs: the one with depth in its name, else the largest, else the first.

    outputs: arrays by name. size: of the picture that the model was given. Raises InputError where no output is a map.
    """
    maps = [(name, np.squeeze(values)) for name, values in outputs.items() if _is_map(name, values, size)]
    if not maps:
        shapes = ", ".join(f"{name} {getattr(values, 'shape', 'a list')}" for name, values in outputs.items())
        raise InputError(f"{file}: gives {shapes[:160]}, not one map of depth (H, W); choose a depth model")
    _, values = min(maps, key=lambda each: (not _has_word(each[0], DEPTH_WORDS), -each[1].size))
    return np.asarray(values, np.float32)


def external_files(file: Path) -> tuple[Path, ...]:
    """The files beside an ONNX file that hold its weights. Raises InputError where one is missing or elsewhere."""
    if not 0 < file.stat().st_size <= MAX_GRAPH_BYTES:
        return ()
    with file.open("rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as content:
        ends = [(match.end(), match[1][0]) for match in EXTERNAL_FILE.finditer(content)]
        found = {content[end : end + length].decode("utf-8", "replace") for end, length in ends}
    for name in sorted(found):
        if not stays_within(name) or not is_file(file.parent / name):
            raise InputError(
                f"{file}: its weights are in {printable(name)}, which does not lie beside it; get that file, too"
            )
    return tuple(file.parent / name for name in sorted(found))


def _channel_axis(shape: Sequence[Any]) -> int | None:
    """Where the channels of a picture's shape are; None where it is no picture of 3 channels."""
    first = len(shape) - 3
    if first not in (0, 1):
        return None
    if shape[first] == CHANNELS:
        return first
    if shape[-1] == CHANNELS:
        return len(shape) - 1
    return None if isinstance(shape[first], int) else first


def _is_map(name: str, values: Any, size: ImageSize) -> bool:
    """Whether an output is as many numbers across and down as a map of a picture of this size may have."""
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu" or _has_word(name, OTHER_WORDS):
        return False
    sides = [side for side in values.shape if side != 1]
    if len(sides) != 2 or min(sides) < MIN_MAP_SIDE:
        return False
    change: float = sides[1] / sides[0] * size.height / size.width
    return 1 / MAX_ASPECT_CHANGE <= change <= MAX_ASPECT_CHANGE


def _has_word(name: str, words: Sequence[str]) -> bool:
    return any(word in name.lower() for word in words)
