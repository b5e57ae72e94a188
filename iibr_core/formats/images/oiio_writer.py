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
from iibr_core.formats.outputs import atomic_write
from iibr_core.types import InputError


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
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], dtype)
    for name, value in (attributes or {}).items():
        spec.attribute(name, value)
    if channels:
        spec.channelnames = channels
    with atomic_write(path) as temporary:
        name = oiio_name(temporary)
        target = oiio.ImageOutput.create(name)
        # Writing to an output that did not open crashes OpenImageIO.
        if target is None or not (target.open(name, spec) and target.write_image(values) and target.close()):
            reason = reason_of(complaint_of(oiio if target is None else target))
            raise InputError(f"{path}: cannot be written ({reason}); choose another place")
        if not _is_whole(temporary, spec.height):
            raise InputError(f"{path}: cannot be written whole (is the disk full?); choose another place")


def _is_whole(path: Path, height: int) -> bool:
    """Whether a PNG has its end, and another picture its last row, which is written last."""
    try:
        require_whole_png(path)
    except InputError:
        return False
    if path.suffix.lower() == ".png":
        return True
    source = oiio.ImageInput.open(oiio_name(path))
    last_row = source and source.read_scanline(height - 1, 0)
    complaint_of(source or oiio)  # or it is told on stderr
    return last_row is not None
