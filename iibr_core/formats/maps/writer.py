"""Writes maps with one value per pixel; a text in the header of a PNG, TIFF or EXR keeps the meaning of their values.

Reading gives back the map as it was written.
"""

from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.maps.map_names import says_depth
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage, InputError

MAP_SUFFIXES = (".pfm", ".exr", ".npy", ".png", ".tif", ".tiff")
KEY = "ImageDescription"
"""The header's field, which PNG, TIFF and EXR all have."""
START = "iibr map "
MAX_PNG_VALUE = 65535
"""Largest value of a 16-bit picture, in which 0 means unknown."""


class MapText(msgspec.Struct, frozen=True):
    """value = stored number * scale + offset; a stored 0 of a PNG is unknown.

    meaning: "disparity", px per view step of a picture as wide as the map, larger is nearer; "depth", larger is
    farther, in `unit`. inverse: (slope, offset) of disparity over 1 / depth, where depth was computed from it.
    """

    meaning: Literal["disparity", "depth"]
    scale: float = 1.0
    offset: float = 0.0
    unit: str = "px per view step"
    inverse: tuple[float, float] | None = None


DISPARITY = MapText("disparity")


def text_from(header: str) -> MapText | None:
    """Return the meaning of a map's values that its header states; None where the text is not ours, or damaged."""
    try:
        return msgspec.json.decode(header.removeprefix(START), type=MapText)
    except msgspec.DecodeError:
        return None


def write_map(path: Path, values: FloatImage, text: MapText = DISPARITY) -> str:
    """Write an (H, W) map of finite values, whole or not at all; return a note about the file, or "".

    text: meaning of the values; PNG, TIFF and EXR keep it. A PNG holds values from 1 to 65535, and its text states
    their scale and offset; all others hold float32. A name that means depth is refused for disparity.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in MAP_SUFFIXES:
        raise InputError(f"{path}: a map can be written as {', '.join(MAP_SUFFIXES)}")
    if text.meaning == "disparity" and says_depth(path.stem):
        raise InputError(f"{path}: a name with _depth means depth, this is disparity; choose another name")
    if kind == ".png":
        return _write_png(path, values, text)
    if kind == ".pfm":
        write_pfm(path, values)
    elif kind == ".npy":
        with write_file(path) as temporary:
            np.save(temporary, np.asarray(values, np.float32))
    else:
        _write_plane(path, np.asarray(values, np.float32), "float", text)
    return ""


def _write_png(path: Path, values: FloatImage, text: MapText) -> str:
    low, high = float(values.min()), float(values.max())
    step = (high - low) / (MAX_PNG_VALUE - 1) or 1.0
    stored = np.rint((values.astype(np.float64) - low) / step).astype(np.uint16) + np.uint16(1)
    _write_plane(path, stored, "uint16", msgspec.structs.replace(text, scale=step, offset=low - step))
    return f"{text.meaning.capitalize()} is {step:.6g} times the stored value, plus {low - step:.6g}; the file says so."


def _write_plane(path: Path, values: np.ndarray, dtype: str, text: MapText) -> None:
    write_image_file(path, values[..., None], dtype, {KEY: START + msgspec.json.encode(text).decode()}, channels=("Y",))
