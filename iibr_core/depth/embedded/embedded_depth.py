"""The depth map that a photo carries within its own file, whoever wrote it there; used before any estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from iibr_core.depth.embedded.apple import appended_estimate, heic_estimate
from iibr_core.depth.embedded.google import all_in_focus, dynamic_depth_estimate, gdepth_estimate, range_notes
from iibr_core.depth.embedded.images import decode_map
from iibr_core.depth.embedded.samsung import samsung_estimate
from iibr_core.depth.embedded.trailers import huawei_estimate, second_picture_estimate
from iibr_core.depth.embedded.xmp import Xmp, is_jpeg, jpeg_layout, xmp_of
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.files import open_binary
from iibr_core.formats.images.avif import avif_depth_file, is_avif
from iibr_core.formats.images.heic import heic_orientation, is_heic, read_heic_depth
from iibr_core.formats.images.lfp import is_lfp, read_lfp_depth
from iibr_core.formats.images.metadata import read_metadata
from iibr_core.formats.images.picture import upright
from iibr_core.formats.images.stereo_jpeg import SOURCE_IMAGE, read_lif
from iibr_core.formats.images.xmp import parse_packet
from iibr_core.types import InputError

MAX_FILE_BYTES = 512 * 2**20
GDEPTH, DYNAMIC_DEPTH = "Google GDepth", "Dynamic Depth"
SAMSUNG, HUAWEI = "Samsung Live focus", "Huawei"
SECOND_PICTURE = "a second, grey picture"
NEAR_END_UNKNOWN = (HUAWEI, SECOND_PICTURE, "AVIF depth")
"""Formats that do not say which end of their values is near: the photo has to decide."""


@dataclass(frozen=True, eq=False)
class EmbeddedDepth:
    """Depth that a photo's file holds beside the picture.

    estimate: at the map's own size, as it is stored (before Exif's orientation, where the photo has one). format: who
    wrote it, for people. all_in_focus: a picture file's bytes, to be shown instead of the photo that the camera
    blurred; None without. notes: sentences about what the file says of the map.
    """

    estimate: DepthEstimate
    format: str
    all_in_focus: bytes | None = None
    notes: tuple[str, ...] = ()

    @property
    def says_near_end(self) -> bool:
        """Whether it is known which end of the values is near; else larger values count as nearer for now."""
        return self.format not in NEAR_END_UNKNOWN


def read_embedded(path: Path) -> EmbeddedDepth | None:
    """Return the depth within a photo's file, None where it holds none. Raises InputError where it is damaged."""
    try:
        for is_kind, read in ((is_avif, _in_avif), (is_heic, _in_heic), (is_lfp, _in_lfp)):
            if is_kind(path):
                return read(path) or _in_packet(path)
        data = jpeg_bytes(path)
        return embedded_in_jpeg(data) if data else _in_packet(path)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(path)) else f"{path}: {text}") from error


def jpeg_bytes(path: Path) -> bytes:
    """Return a JPEG file whole; b"" for other files and absurdly large ones. Raises InputError where it is missing."""
    with open_binary(path) as file:
        start = file.read(3)
        file.seek(0)  # joined to what follows, the file would be there twice
        return file.read() if is_jpeg(start) and path.stat().st_size <= MAX_FILE_BYTES else b""


def _in_avif(path: Path) -> EmbeddedDepth | None:
    data = avif_depth_file(path)
    if data is None:
        return None
    return EmbeddedDepth(
        DepthEstimate(decode_map(data, "the depth map of the AVIF", ("AVIF",)), "inverse depth"), "AVIF depth"
    )


def _in_heic(path: Path) -> EmbeddedDepth | None:
    depth = read_heic_depth(path)
    if depth is not None:
        return EmbeddedDepth(heic_estimate(*depth), "Apple portrait")
    with open_binary(path) as file:
        found = samsung_estimate(file.read(MAX_FILE_BYTES))
    if found is None:
        return None
    # A HEIC's photo is always read upright.
    return EmbeddedDepth(DepthEstimate(upright(found.values, heic_orientation(path)), "inverse depth"), SAMSUNG)


def _in_lfp(path: Path) -> EmbeddedDepth | None:
    depth = read_lfp_depth(path)
    return None if depth is None else EmbeddedDepth(DepthEstimate(-depth, "inverse depth"), "Lytro")


def _in_packet(path: Path) -> EmbeddedDepth | None:
    """Return the depth in the XMP of any other kind of picture, as GDepth."""
    packet = read_metadata(path).xmp
    if b"/1.0/depthmap/" not in packet:
        return None
    xmp = Xmp((parse_packet(packet),))
    estimate = gdepth_estimate(xmp)
    return None if estimate is None else EmbeddedDepth(estimate, GDEPTH, all_in_focus(xmp), range_notes(xmp))


def embedded_in_jpeg(data: bytes) -> EmbeddedDepth | None:
    """Return the depth within a JPEG file's bytes, None where it holds none.

    Formats are tried in turn; a damaged one ends the search with InputError only where no other is whole.
    """
    layout = jpeg_layout(data)
    xmp, damaged = Xmp(), None
    try:
        xmp = xmp_of(layout)
    except InputError as error:
        damaged = error
    readers: tuple[tuple[str, Callable[[], DepthEstimate | None]], ...] = (
        (DYNAMIC_DEPTH, lambda: dynamic_depth_estimate(xmp, data, layout)),
        (GDEPTH, lambda: gdepth_estimate(xmp)),
        ("Apple portrait", lambda: appended_estimate(data, layout.end)),
        (SAMSUNG, lambda: samsung_estimate(data)),
        ("Leia", lambda: leia_estimate(data)),
        (HUAWEI, lambda: huawei_estimate(data, layout.end)),
        (SECOND_PICTURE, lambda: second_picture_estimate(data, layout.end)),
    )
    for name, read in readers:
        try:
            estimate = read()
        except InputError as error:
            damaged = damaged or error
            continue
        if estimate is not None:
            notes = range_notes(xmp) if name in (GDEPTH, DYNAMIC_DEPTH) else ()
            return EmbeddedDepth(estimate, name, all_in_focus(xmp) if name == GDEPTH else None, notes)
    if damaged is not None:
        raise damaged
    return None


def leia_estimate(data: bytes) -> DepthEstimate | None:
    """Return the map of a Leia image's own view, white near; None where a JPEG's bytes hold no such map.

    Raises InputError where it is damaged.
    """
    leia = read_lif(data)
    view = next((view for view in leia.views if view.image == SOURCE_IMAGE), None) if leia is not None else None
    if leia is None or view is None or view.inverse_depth is None:
        return None
    return DepthEstimate(decode_map(leia.fields[view.inverse_depth], "Leia's map of inverse depth"), "inverse depth")
