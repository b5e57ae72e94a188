"""OpenEXR files of several parts, each a picture of linear light with its name, and maybe its disparity."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.formats.files import reason_of
from iibr_core.formats.images.oiio_names import oiio_name
from iibr_core.formats.images.oiio_reader import complaint_of
from iibr_core.formats.outputs import write_file
from iibr_core.types import ImageSize, InputError

COLORS = {"R": "half", "G": "half", "B": "half"}
DISPARITY = {"disparity": "float"}
"""px per view step."""


@dataclass(frozen=True)
class ExrPart:
    """channels: OpenImageIO's word for how each is stored, by its name."""

    name: str
    channels: dict[str, str]


def write_exr_parts(path: Path, size: ImageSize, parts: Sequence[ExrPart], pictures: Iterable[NDArray[Any]]) -> None:
    """Write a picture (H, W, channels), linear light, float, for each part, in their order; whole or not at all.

    Raises InputError where it cannot be written; what the pictures raise goes through.
    """
    specs = [_spec(size, part) for part in parts]
    with write_file(path) as temporary:
        name = oiio_name(temporary)
        target: Any = oiio.ImageOutput.create(name)
        is_written = target is not None and target.open(name, tuple(specs))
        for index, (spec, picture) in enumerate(zip(specs, pictures, strict=True)):
            if index:
                is_written = is_written and target.open(name, spec, "AppendSubimage")
            is_written = is_written and target.write_image(_storable(picture, parts[index]))
            if not is_written:
                break
        if not (is_written and target.close()) or not _is_whole(temporary, len(parts)):
            reason = reason_of(complaint_of(oiio if target is None else target))
            raise InputError(f"{path}: cannot be written ({reason}); choose another place")


def _spec(size: ImageSize, part: ExrPart) -> Any:
    spec = oiio.ImageSpec(size.width, size.height, len(part.channels), "float")
    spec.channelnames = tuple(part.channels)
    spec.channelformats = tuple(map(oiio.TypeDesc, part.channels.values()))
    spec.attribute("name", part.name)
    spec.attribute("oiio:subimagename", part.name)
    spec.attribute("compression", "zip")
    return spec


def _storable(picture: NDArray[Any], part: ExrPart) -> NDArray[np.float32]:
    """Within what half floats hold."""
    most = float(np.finfo(np.float16).max) if "half" in part.channels.values() else float(np.finfo(np.float32).max)
    return np.ascontiguousarray(np.clip(np.nan_to_num(picture), -most, most), np.float32)


def _is_whole(path: Path, parts: int) -> bool:
    """Whether the last part has its last row: of a disk that fills up nothing is told."""
    source = oiio.ImageInput.open(oiio_name(path))
    last = source and source.seek_subimage(parts - 1, 0) and source.read_scanline(source.spec().height - 1)
    complaint_of(source or oiio)
    return last is not None and last is not False
