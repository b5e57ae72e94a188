"""The depth map that a photo carries within its own file, whoever wrote it there; used before any estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from iibr_core.depth.embedded.apple import appended_estimate, heic_estimate
from iibr_core.depth.embedded.google import all_in_focus, dynamic_depth_estimate, gdepth_estimate
from iibr_core.depth.embedded.leia import leia_estimate
from iibr_core.depth.embedded.samsung import samsung_estimate
from iibr_core.depth.embedded.trailers import huawei_estimate, second_picture_estimate
from iibr_core.depth.embedded.xmp import Xmp, is_jpeg, jpeg_layout, xmp_of
from iibr_core.depth.estimates import Estimate
from iibr_core.formats.files import open_binary
from iibr_core.formats.images.heic import is_heic, read_heic_depth
from iibr_core.types import InputError

MAX_FILE_BYTES = 512 * 2**20
GDEPTH = "Google GDepth"
SECOND_PICTURE = "a second, grey picture"
"""What no header describes: it may be near where it is white, or where it is black."""


@dataclass(frozen=True, eq=False)
class EmbeddedDepth:
    """What a photo's file holds beside the picture.

    estimate: at the map's own size, as it is stored (before Exif's orientation, where the photo has one). format: who
    wrote it, for people. all_in_focus: a picture file's bytes, to be shown instead of the photo that the camera
    blurred; None without.
    """

    estimate: Estimate
    format: str
    all_in_focus: bytes | None = None


def read_embedded(path: Path) -> EmbeddedDepth | None:
    """The depth within a photo's file, None where it holds none. Raises InputError where it is damaged."""
    try:
        if is_heic(path):
            return _of_heic(path)
        return _of_jpeg(path)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(path)) else f"{path}: {text}") from error


def _of_heic(path: Path) -> EmbeddedDepth | None:
    depth = read_heic_depth(path)
    return None if depth is None else EmbeddedDepth(heic_estimate(depth.values, depth.metadata), "Apple portrait")


def _of_jpeg(path: Path) -> EmbeddedDepth | None:
    with open_binary(path) as file:
        start = file.read(3)
        file.seek(0)  # joined to what follows, the file would be there twice
        data = file.read() if is_jpeg(start) and path.stat().st_size <= MAX_FILE_BYTES else b""
    return embedded_in_jpeg(data) if data else None


def embedded_in_jpeg(data: bytes) -> EmbeddedDepth | None:
    """The depth within a JPEG file's bytes, None where it holds none.

    Formats are tried in turn; a damaged one ends the search with InputError only where no other is whole.
    """
    layout = jpeg_layout(data)
    xmp, damaged = Xmp(), None
    try:
        xmp = xmp_of(layout)
    except InputError as error:
        damaged = error
    readers: tuple[tuple[str, Callable[[], Estimate | None]], ...] = (
        ("Dynamic Depth", lambda: dynamic_depth_estimate(xmp, data, layout)),
        (GDEPTH, lambda: gdepth_estimate(xmp)),
        ("Apple portrait", lambda: appended_estimate(data, layout.end)),
        ("Samsung Live focus", lambda: samsung_estimate(data)),
        ("Leia", lambda: leia_estimate(data)),
        ("Huawei", lambda: huawei_estimate(data, layout.end)),
        (SECOND_PICTURE, lambda: second_picture_estimate(data, layout.end)),
    )
    for name, read in readers:
        try:
            estimate = read()
        except InputError as error:
            damaged = damaged or error
            continue
        if estimate is not None:
            return EmbeddedDepth(estimate, name, all_in_focus(xmp) if name == GDEPTH else None)
    if damaged is not None:
        raise damaged
    return None
