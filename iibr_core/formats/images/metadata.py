"""What a photo says beside its pixels, and what of it goes into pictures made of it: Exif, XMP, and texts of our own.

Kept is what describes the photo and its camera. Left out is what would be wrong in another picture (thumbnails, depth
maps, what other programs did to it, makers' notes, which are bound to their place in the file), and where the photo was
taken, unless that is asked for.
"""

from __future__ import annotations

import base64
import binascii
import math
import struct
import warnings
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from iibr_core.formats.images.heic import DECODE_ERRORS, is_heic
from iibr_core.formats.images.xmp_packet import parse_packet
from iibr_core.types import SRGB, ColorSpace, ImageSize, InputError

EXIF_ERRORS = (*DECODE_ERRORS, struct.error, TypeError, ZeroDivisionError, KeyError, AttributeError, OverflowError)
EXIF_IFD, GPS_IFD = 0x8769, 0x8825
ORIENTATION, MAKER_NOTE, INTEROPERABILITY, COLOR_SPACE = 0x0112, 0x927C, 0xA005, 0xA001
WIDTH, HEIGHT = 0xA002, 0xA003
PER_UNIT = (0xA20E, 0xA20F)
"""FocalPlaneXResolution and Y: pixels a unit of length."""
DESCRIBING = frozenset(
    {0x010E, 0x010F, 0x0110, 0x011A, 0x011B, 0x0128, 0x0131, 0x0132, 0x013B, 0x013C, 0x4746, 0x4749, 0x8298}
    | set(range(0x9C9B, 0x9CA0))
)
"""Tags of the first folder that are of the photo, not of how its file stores it: description, make, model, resolution,
software, date, artist, computer, rating, copyright, and what Windows keeps.
"""
PLACES_IN_PIXELS = frozenset({0x9214, 0xA214})
UNCALIBRATED = 0xFFFF
MOST_EXIF_BYTES = 65_000
"""A JPEG holds no more."""
RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
XMP_META = "adobe:ns:meta/"
OURS = "urn:iibr:1.0/"
NAMESPACES = {
    "x": XMP_META,
    "rdf": RDF,
    "dc": "http://purl.org/dc/elements/1.1/",
    "xmp": "http://ns.adobe.com/xap/1.0/",
    "xmpRights": "http://ns.adobe.com/xap/1.0/rights/",
    "photoshop": "http://ns.adobe.com/photoshop/1.0/",
    "Iptc4xmpCore": "http://iptc.org/std/Iptc4xmpCore/1.0/xmlns/",
    "lr": "http://ns.adobe.com/lightroom/1.0/",
    "cc": "http://creativecommons.org/ns#",
    "plus": "http://ns.useplus.org/ldf/xmp/1.0/",
    "MicrosoftPhoto": "http://ns.microsoft.com/photo/1.0/",
    "iibr": OURS,
}
"""Of what is kept: who made the picture, its title, words, rating and rights."""
KEPT_NAMESPACES = frozenset(NAMESPACES.values()) - {XMP_META, RDF, OURS}
DROPPED_NAMES = frozenset({"Thumbnails", "DocumentAncestors", "SidecarForExtension"})
MOST_PLAIN_CHARACTERS = 20_000
"""Of a text of ours in XMP: longer ones are packed, for a JPEG holds 64 KB."""
PACKED = "zlib,base64:"
MOST_UNPACKED_BYTES = 4_000_000
PACKET_START = b'<?xpacket begin="\xef\xbb\xbf" id="W5M0MpCehiHzreSzNTczkc9d"?>\n'
PACKET_END = b'\n<?xpacket end="w"?>'


@dataclass(frozen=True, eq=False)
class PictureMetadata:
    """exif: as it stands in JPEG files, b"" without. xmp: a packet, b"" without. texts: of our own, by name."""

    exif: bytes = b""
    xmp: bytes = b""
    texts: Mapping[str, str] = field(default_factory=dict)


def read_metadata(path: Path) -> PictureMetadata:
    """What a photo's file says of it; nothing where it says nothing, is damaged, or not there any more."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _read_heic(path) if is_heic(path) else _read_others(path)
    except (InputError, *EXIF_ERRORS):
        return PictureMetadata()


def _read_heic(path: Path) -> PictureMetadata:
    import pillow_heif

    info = pillow_heif.open_heif(path).info
    return PictureMetadata(_bytes_of(info.get("exif")), _bytes_of(info.get("xmp")))


def _read_others(path: Path) -> PictureMetadata:
    from PIL import Image

    try:
        with Image.open(path) as image:
            exif = _bytes_of(image.info.get("exif"))
            if not exif:  # a TIFF's is all of its own folder
                folder = image.getexif()
                exif = _describing(folder).tobytes() if folder else b""
            return PictureMetadata(exif, _bytes_of(image.info.get("xmp")))
    except Image.DecompressionBombError:
        return PictureMetadata()


def _bytes_of(value: Any) -> bytes:
    return value.encode() if isinstance(value, str) else bytes(value or b"")


def _describing(exif: Any, folders: tuple[int, ...] = (EXIF_IFD, GPS_IFD)) -> Any:
    """A copy with what describes the photo: of its own tags, and all of these folders."""
    from PIL import Image

    kept = Image.Exif()
    for tag in sorted(DESCRIBING & set(exif)):
        kept[tag] = exif[tag]
    for folder in folders:
        if found := dict(exif.get_ifd(folder)):
            kept.get_ifd(folder).update(found)
    return kept


def exif_for(exif: bytes, size: ImageSize, color_space: ColorSpace, keeps_position: bool) -> Any:
    """A photo's Exif for an upright picture of another size, as Pillow's record; an empty one where it is damaged."""
    from PIL import Image

    kept = Image.Exif()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            whole = Image.Exif()
            whole.load(exif)
            has_camera = bool(whole.get_ifd(EXIF_IFD))
            kept = _describing(whole, (EXIF_IFD,) if not keeps_position else (EXIF_IFD, GPS_IFD))
            if kept or has_camera:
                kept[ORIENTATION] = 1
            if has_camera:
                _set_camera(kept.get_ifd(EXIF_IFD), size, color_space)
            if len(kept.tobytes()) > MOST_EXIF_BYTES:
                return Image.Exif()
    except EXIF_ERRORS:
        return Image.Exif()
    return kept


def _set_camera(camera: dict[int, Any], size: ImageSize, color_space: ColorSpace) -> None:
    """Change what depends on the picture in the folder about the camera, and leave out what no longer fits."""
    for tag in (MAKER_NOTE, INTEROPERABILITY, *PLACES_IN_PIXELS):
        camera.pop(tag, None)
    width_before = camera.get(WIDTH)
    for tag in PER_UNIT:
        if tag in camera and isinstance(width_before, int) and width_before > 0:
            camera[tag] = float(camera[tag]) * max(size) / max(width_before, camera.get(HEIGHT) or 0)
        else:
            camera.pop(tag, None)
    camera[WIDTH], camera[HEIGHT] = size.width, size.height
    camera[COLOR_SPACE] = 1 if color_space == SRGB else UNCALIBRATED


def xmp_for(xmp: bytes, texts: Mapping[str, str]) -> bytes:
    """A packet with what is kept of a photo's, and texts of our own; b"" where that is nothing."""
    described = Element(f"{{{RDF}}}Description", {f"{{{RDF}}}about": ""})
    for name, text in texts.items():
        described.set(f"{{{OURS}}}{_local(name)}", _pack(text))
    try:
        for source in parse_packet(xmp).iter(f"{{{RDF}}}Description") if xmp else ():
            _copy_properties(source, described)
    except InputError:
        pass  # a photo is one without its XMP too
    if len(described) == 0 and len(described.attrib) == 1:
        return b""
    for prefix, uri in NAMESPACES.items():
        ElementTree.register_namespace(prefix, uri)
    root = Element(f"{{{XMP_META}}}xmpmeta")
    SubElement(root, f"{{{RDF}}}RDF").append(described)
    packet: bytes = ElementTree.tostring(root, encoding="utf-8")
    return PACKET_START + packet + PACKET_END


def _copy_properties(source: Element, target: Element) -> None:
    for name, value in source.attrib.items():
        if _is_kept(name) and name not in target.attrib:
            target.set(name, value)
    known = {child.tag for child in target}
    target.extend(child for child in source if _is_kept(child.tag) and child.tag not in known)


def _is_kept(name: str) -> bool:
    namespace, _, local = name[1:].partition("}")
    return name.startswith("{") and namespace in KEPT_NAMESPACES and local not in DROPPED_NAMES


def text_in_xmp(path: Path, name: str) -> str:
    """A text of ours in a picture's XMP, as it was written by `xmp_for`; "" without. Raises InputError where it is
    damaged.
    """
    xmp = read_metadata(path).xmp
    if OURS.encode() not in xmp:
        return ""
    key = f"{{{OURS}}}{_local(name)}"
    texts = (element.attrib[key] for element in parse_packet(xmp).iter() if key in element.attrib)
    return unpack_text(next(texts, ""), path)


def _local(name: str) -> str:
    return name.rpartition(":")[2]


def _pack(text: str) -> str:
    if len(text) <= MOST_PLAIN_CHARACTERS:
        return text
    return PACKED + base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")


def unpack_text(text: str, path: Path) -> str:
    """A text as it was before it was packed for XMP. Raises InputError where it is damaged."""
    if not text.startswith(PACKED):
        return text
    try:
        packed = zlib.decompressobj()
        return packed.decompress(base64.b64decode(text[len(PACKED) :]), MOST_UNPACKED_BYTES).decode()
    except (ValueError, binascii.Error, zlib.error) as error:
        raise InputError(f"{path}: its settings are damaged; set them by hand") from error


def camera_facts(metadata: PictureMetadata) -> tuple[tuple[str, str], ...]:
    """What a photo's Exif says about how it was taken, for people: (what, value); without what it does not say."""
    from PIL import Image

    exif = Image.Exif()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            exif.load(metadata.exif)
            camera = exif.get_ifd(EXIF_IFD)
    except EXIF_ERRORS:
        return ()
    facts = (
        ("Camera", " ".join(dict.fromkeys(f"{_words(exif.get(0x010F))} {_words(exif.get(0x0110))}".split()))),
        ("Lens", _words(camera.get(0xA434))),
        ("Exposure", ", ".join(filter(None, _exposure(camera)))),
        ("Taken", _words(camera.get(0x9003))[:16].replace(":", "-", 2)),
    )
    return tuple((what, value) for what, value in facts if value)


def _exposure(camera: Mapping[int, Any]) -> tuple[str, ...]:
    """F-number, time, sensitivity and focal length, each "" where it is not known."""
    number, seconds, iso, focal_mm, equivalent_mm = (
        _positive(camera.get(tag)) for tag in (0x829D, 0x829A, 0x8827, 0x920A, 0xA405)
    )
    time = f"1/{1 / seconds:.0f} s" if 0 < seconds < 0.4 else f"{seconds:g} s"
    return (
        f"f/{number:g}" if number else "",
        time if seconds else "",
        f"ISO {iso:g}" if iso else "",
        f"{equivalent_mm:g} mm (35 mm)" if equivalent_mm else f"{focal_mm:g} mm" if focal_mm else "",
    )


def _positive(value: Any) -> float:
    """A number of Exif; 0 where it is none, or means nothing."""
    try:
        number = float(value[0] if isinstance(value, tuple) else value)
    except (*EXIF_ERRORS,):
        return 0.0
    return number if math.isfinite(number) and 0 < number < 1e9 else 0.0


def _words(value: Any) -> str:
    """A text of Exif in one short line."""
    return (
        " ".join("".join(c if c.isprintable() else " " for c in value).split())[:60] if isinstance(value, str) else ""
    )
