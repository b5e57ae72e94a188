"""Writes pictures through OpenImageIO, whole or not at all: it tells nothing of a disk that fills up while it closes a
file, so what was written is looked at.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.formats.files import reason_of
from iibr_core.formats.images.oiio_names import oiio_name
from iibr_core.formats.images.oiio_reader import complaint_of, require_whole_png
from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError

PNG_SETTINGS: Mapping[str, str | int | float] = {"png:compressionLevel": 1, "png:filter": 64}
"""Level 1 is 8 times faster than the default 6, 10 % larger; filter 64 is the average."""


def write_image_file(
    path: Path,
    values: NDArray[Any],
    dtype: str,
    attributes: Mapping[str, str | int | float] | None = None,
    channels: tuple[str, ...] = (),
) -> None:
    """Write values (H, W, C), stored as `dtype` in OpenImageIO's words ("uint8", "half", "float").

    attributes: of the file's header. channels: their names, where they are not those of grey, RGB or RGBA. Raises
    InputError where that cannot be done.
    """
    with write_file(path) as temporary:
        try:
            encode_image_file(temporary, values, dtype, attributes, channels)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error


def encode_image_file(
    path: Path,
    values: NDArray[Any],
    dtype: str,
    attributes: Mapping[str, Any] | None = None,
    channels: tuple[str, ...] = (),
) -> None:
    """The same, to a place that is put in place by others. Raises InputError without the file's name."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], dtype)
    for name, value in (attributes or {}).items():
        if isinstance(value, tuple):
            spec.attribute(name, oiio.TypeDesc(f"float[{len(value)}]"), value)
        else:
            spec.attribute(name, value)
    if channels:
        spec.channelnames = channels
    name = oiio_name(path)
    target = oiio.ImageOutput.create(name)
    # Writing to an output that did not open crashes OpenImageIO.
    if target is None or not (target.open(name, spec) and target.write_image(values) and target.close()):
        reason = reason_of(complaint_of(oiio if target is None else target))
        raise InputError(f"cannot be written ({reason}); choose another place")
    if not _is_whole(path, spec.height):
        raise InputError("cannot be written whole (is the disk full?); choose another place")


def _is_whole(path: Path, height: int) -> bool:
    """Whether a PNG has its end, and another picture its last row, which is written last."""
    try:
        require_whole_png(path)
    except InputError:
        return False
    if path.suffix.lower() == ".png":
        return True
    source = oiio.ImageInput.open(oiio_name(path))
    last_row = source and source.read_scanline(height - 1)
    complaint_of(source or oiio)  # or it is told on stderr
    return last_row is not None
