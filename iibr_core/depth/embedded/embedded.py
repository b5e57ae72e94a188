"""The depth map within a photo's own file, in any known format; it is used before any estimate."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from iibr_core.depth.embedded.apple import appended_estimate, heic_estimate
from iibr_core.depth.embedded.google import (
    all_in_focus,
    dynamic_depth_estimate,
    dynamic_original,
    gdepth_estimate,
    range_notes,
)
from iibr_core.depth.embedded.images import PICTURE_STARTS, decode_map
from iibr_core.depth.embedded.jpeg import HEADER_BYTES, appended_pictures, jpeg_layout, xmp_of
from iibr_core.depth.embedded.trailers import (
    huawei_estimate,
    samsung_estimate,
    samsung_in_focus,
    second_in_focus,
    second_picture_estimate,
    thumbnail_of,
)
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.files import MAX_FILE_BYTES, read_bytes
from iibr_core.formats.images.avif import avif_depth_file
from iibr_core.formats.images.file_kinds import Kind
from iibr_core.formats.images.heic import heic_info, heic_orientation, read_heic_depth
from iibr_core.formats.images.jpeg_xl import has_depth_channel
from iibr_core.formats.images.lfp import open_lfp
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.picture import upright
from iibr_core.formats.images.record3d import read_recording
from iibr_core.formats.images.stereo_jpeg import SOURCE_IMAGE, read_lif
from iibr_core.formats.images.xmp import parse_packet
from iibr_core.formats.maps.disparity_file import has_shape_of
from iibr_core.formats.maps.other_maps import depth_of_lzfse
from iibr_core.types import ImageSize, InputError, Photo, image_size

GDEPTH, DYNAMIC_DEPTH = "Google GDepth", "Dynamic Depth"
SAMSUNG, HUAWEI = "Samsung Live focus", "Huawei"
SECOND_PICTURE, AVIF = "a second, grey picture", "AVIF depth"

TRAILERS = (
    (re.compile(rb"PMPD[\x01-\x09]\0"), "a depth map of Xiaomi's kind (PMPD)"),
    (re.compile(rb"DualShot_DepthMap"), "a depth map of Samsung's of an unknown layout"),
    (re.compile(rb"\0edof\0"), "a depth map of Huawei's, cut off or of an unknown layout"),
)
"""Marks of depth maps behind a photo that are not read."""
MATTE = re.compile(rb"urn:com:apple:photo:\d+:aux:(?:semantic)?(\w+?)matte")
GAIN_MAP = re.compile(rb"hdrgm:|HDRGainMap|GainMap|urn:iso:std:iso:ts:21496|aux:hdrgainmap", re.IGNORECASE)
CONTAINER = re.compile(rb"MPF\0|photos/1.0/container/|photos/dd/1.0/container/|GCamera:MicroVideo")
"""Marks of lists of pictures behind a photo: previews, gain maps and films, never depth."""


@dataclass(frozen=True, eq=False)
class EmbeddedDepth:
    """Depth that a photo's file holds beside the picture.

    estimate: at the map's size, as stored (before Exif's orientation, if the photo has one). format: its name, for
    people. all_in_focus: a picture file's bytes, to be shown instead of the photo that the camera blurred; None
    without. notes: sentences about the map.
    """

    estimate: DepthEstimate
    format: str
    all_in_focus: bytes | None = None
    notes: tuple[str, ...] = ()

    @property
    def says_near_end(self) -> bool:
        """Return whether the format states the near end of the values; else the photo has to decide."""
        return self.format not in (HUAWEI, SECOND_PICTURE, AVIF)


def read_embedded(path: Path) -> EmbeddedDepth | None:
    """Return the depth within a photo's file, None if it holds none. Raises InputError if it is damaged."""
    try:
        if (read := READERS.get(open_picture(path).kind)) is not None:
            return read(path) or _in_packet(path)
        data = _jpeg_bytes(path)
        return embedded_in_jpeg(data) if data else _in_packet(path)
    except InputError as error:
        raise InputError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from error


def embedded_in_jpeg(data: bytes) -> EmbeddedDepth | None:
    """Return the depth within a JPEG file's bytes, None if it holds none.

    Formats are tried in turn. Raises InputError if a format is damaged and no other one is whole.
    """
    layout, xmp, damage = jpeg_layout(data), Element("xmp"), None
    try:
        xmp = xmp_of(layout)
    except InputError as error:
        damage = error
    end = layout.end
    formats: dict[str, tuple[Callable[[], DepthEstimate | None], Callable[[], bytes | None]]] = {
        DYNAMIC_DEPTH: (lambda: dynamic_depth_estimate(xmp, data, end), lambda: dynamic_original(xmp, data, end)),
        GDEPTH: (lambda: gdepth_estimate(xmp), lambda: all_in_focus(xmp) or second_in_focus(data, end)),
        "Apple portrait": (lambda: appended_estimate(data, end), lambda: None),
        SAMSUNG: (lambda: samsung_estimate(data), lambda: samsung_in_focus(data)),
        "Leia": (lambda: leia_estimate(data), lambda: None),
        HUAWEI: (lambda: huawei_estimate(data, end), lambda: second_in_focus(data, end)),
        SECOND_PICTURE: (lambda: second_picture_estimate(data, end), lambda: second_in_focus(data, end)),
    }
    for name, (read_map, read_in_focus) in formats.items():
        try:
            estimate = read_map()
        except InputError as error:
            damage = damage or error
            continue
        if estimate is not None:
            notes = range_notes(xmp) if name in (GDEPTH, DYNAMIC_DEPTH) else ()
            try:
                return EmbeddedDepth(estimate, name, read_in_focus(), notes)
            except InputError:  # b"" stands for a damaged picture
                return EmbeddedDepth(estimate, name, b"", notes)
    if damage is not None:
        raise damage
    return None


def leia_estimate(data: bytes) -> DepthEstimate | None:
    """Return the map of a Leia image's first view, white near; None without. Raises InputError if it is damaged."""
    leia = read_lif(data, "Leia image")
    if leia is None:
        return None
    fields = (view.inverse_depth for view in leia.views if view.image == SOURCE_IMAGE)
    field = next((field for field in fields if field is not None), None)
    if field is None:
        return None
    return DepthEstimate(decode_map(leia.fields[field], "Leia's map of inverse depth"), "inverse depth")


def photo_in_focus(path: Path, photo: Photo, embedded: EmbeddedDepth, max_pixels: int) -> Photo:
    """Return the sharp picture of a file as the photo, turned like it.

    The photo itself is returned if the file holds no sharp picture, or a damaged one, or one of another shape.
    """
    if embedded.all_in_focus is None:
        return photo
    try:
        sharp = _read_sharp(embedded.all_in_focus, open_picture(path).orientation, max_pixels)
        if not has_shape_of(sharp.size, photo.size):
            raise InputError("the sharp one has another shape.")
    except InputError as error:
        return replace(photo, notes=(*photo.notes, f"The blurred picture is shown: {error}"))
    notes = (*photo.notes, "The sharp picture that the file holds is shown, not the blurred one.")
    focal_px = photo.focal_px * sharp.size.width / photo.size.width
    return replace(photo, pixels=sharp.pixels, focal_px=focal_px, notes=notes, color_space=sharp.color_space)


def _read_sharp(data: bytes, orientation: int, max_pixels: int) -> Photo:
    """Return the picture of a file's bytes, turned by `orientation` if it states none itself."""
    if not data.startswith(PICTURE_STARTS):
        raise InputError(f"the all-in-focus picture is neither a PNG nor a JPEG picture ({len(data):,} bytes)")
    with tempfile.TemporaryDirectory(prefix="iibr-") as folder:
        path = Path(folder, "picture")
        path.write_bytes(data)
        try:
            sharp = read_photo(path, max_pixels, keeps_primaries=True)
            is_turned = open_picture(path).orientation != 1
        except InputError as error:
            raise InputError(f"the all-in-focus picture: {str(error).removeprefix(f'{path}: ')}") from error
    return sharp if is_turned else replace(sharp, pixels=upright(sharp.pixels, orientation))


def rotate_estimate(estimate: DepthEstimate, size: ImageSize, orientation: int) -> DepthEstimate:
    """Return the estimate, turned upright as the photo was, unless it was stored upright.

    Maps of another shape show the whole photo, stretched, as GDepth's specification demands. Raises InputError if the
    map lies across the photo however it is turned.
    """
    turned = (upright(estimate.values, orientation), estimate.values)
    alike = [values for values in turned if has_shape_of(image_size(values), size)]
    # Both are wide, or both are high.
    stretched = [values for values in turned if (values.shape[1] - values.shape[0]) * (size.width - size.height) >= 0]
    if not alike + stretched:
        raise InputError(f"its {image_size(estimate.values)} pixels lie across the photo, {size}")
    return DepthEstimate((alike + stretched)[0], estimate.meaning)


def unread_parts(path: Path) -> tuple[str, ...]:
    """Return a sentence for each part of a photo's file that looks like depth and is not read.

    It is meant for photos without known depth, so that a guess is explained. Raises InputError if the file is missing.
    """
    listed = heic_info(path).get("aux") or () if open_picture(path).kind == "HEIC" else ()
    parts = _mattes(" ".join(map(str, listed)).encode()) + _unread_in_jpeg(_jpeg_bytes(path))
    if has_depth_channel(path):
        parts.append(f"a depth channel (save it, for example with djxl, as {path.stem}_depth.png)")
    return tuple(f"{path.name} holds {part}; this is not read." for part in parts)


def _unread_in_jpeg(data: bytes) -> list[str]:
    end = jpeg_layout(data).end
    parts = [words for mark, words in TRAILERS if mark.search(data, end)] + _mattes(data[end:])
    if CONTAINER.search(data, 0, min(end, HEADER_BYTES)):
        return parts
    for picture, _ in appended_pictures(data, end):
        found = thumbnail_of(picture)
        if found and not any(mark.search(picture, 0, HEADER_BYTES) for mark in (GAIN_MAP, MATTE)):
            parts.append(f"a second picture ({found.size}, {'grey' if found.is_grey else 'colour'})")
    return parts


def _mattes(data: bytes) -> list[str]:
    names = ", ".join(dict.fromkeys(found[1].decode() for found in MATTE.finditer(data)))
    names = names.replace("portraiteffects", "portrait effects")
    return [f"mattes ({names}), which are no depth maps"] if names else []


def _jpeg_bytes(path: Path) -> bytes:
    """Return a whole JPEG file, b"" for other and very large files. Raises InputError if it is missing."""
    if open_picture(path).kind != "JPEG" or path.stat().st_size > MAX_FILE_BYTES:
        return b""
    return read_bytes(path)


def _in_avif(path: Path) -> EmbeddedDepth | None:
    data = avif_depth_file(path)
    if data is None:
        return None
    return EmbeddedDepth(DepthEstimate(decode_map(data, "the depth map of the AVIF", ("AVIF",)), "inverse depth"), AVIF)


def _in_heic(path: Path) -> EmbeddedDepth | None:
    depth = read_heic_depth(path)
    if depth is not None:
        return EmbeddedDepth(heic_estimate(*depth), "Apple portrait")
    data = read_bytes(path)
    found = samsung_estimate(data)
    if found is None:
        return None
    # A HEIC's photo is always read upright.
    turned = DepthEstimate(upright(found.values, heic_orientation(path)), "inverse depth")
    return EmbeddedDepth(turned, SAMSUNG, samsung_in_focus(data))


def _in_lfp(path: Path) -> EmbeddedDepth | None:
    lfp = open_lfp(path)
    depth = None if lfp is None else lfp.depth
    return None if depth is None else EmbeddedDepth(DepthEstimate(-depth, "inverse depth"), "Lytro")


def _in_packet(path: Path) -> EmbeddedDepth | None:
    """Return the depth in the XMP of any other kind of picture, as GDepth."""
    packet = open_picture(path).metadata.xmp
    if b"/1.0/depthmap/" not in packet:
        return None
    xmp = parse_packet(packet)
    estimate = gdepth_estimate(xmp)
    return None if estimate is None else EmbeddedDepth(estimate, GDEPTH, all_in_focus(xmp), range_notes(xmp))


def _in_recording(path: Path) -> EmbeddedDepth:
    recording = read_recording(path)
    distances = depth_of_lzfse(recording.distances, str(path))
    if distances.size != math.prod(recording.size):
        raise InputError(f"{path}: its map holds {distances.size:,} distances, not {recording.size}")
    known = np.where(distances > 0, distances, np.float32(np.nan)).reshape(recording.size)
    return EmbeddedDepth(DepthEstimate(known, "metres"), "Record3D")


READERS: dict[Kind, Callable[[Path], EmbeddedDepth | None]] = {
    "AVIF": _in_avif,
    "HEIC": _in_heic,
    "Lytro": _in_lfp,
    "Record3D": _in_recording,
}
"""Functions that return the depth within a kind of files, None without."""
