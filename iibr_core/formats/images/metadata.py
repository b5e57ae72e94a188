"""Metadata of picture files: Exif and XMP, captions, camera facts, and settings of this program.

Saved pictures keep what describes the photo and its camera. They do not keep what would be wrong in another picture:
thumbnails, depth maps, edits by other programs, maker notes, and, unless asked for, the place of the photo.
"""

from __future__ import annotations

import base64
import binascii
import math
import warnings
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, ParseError, SubElement, TreeBuilder

from defusedxml.common import DTDForbidden
from defusedxml.ElementTree import DefusedXMLParser
from PIL import Image

from iibr_core.formats.images.decode import read_size, read_text
from iibr_core.formats.images.heic import heic_info, is_heic
from iibr_core.formats.images.pillow_reader import EXIF_ERRORS, EXIF_FOLDER, ORIENTATION_TAG
from iibr_core.types import (
    SRGB,
    ColorSpace,
    ImageSize,
    InputError,
)

GPS_FOLDER = 0x8825
MAKER_NOTE, INTEROPERABILITY, COLOR_SPACE, WIDTH, HEIGHT = 0x927C, 0xA005, 0xA001, 0xA002, 0xA003
DESCRIPTION, MAKE, MODEL, ARTIST, COPYRIGHT = 0x010E, 0x010F, 0x0110, 0x013B, 0x8298
RESOLUTION_TAGS = (0xA20E, 0xA20F)
"""FocalPlaneXResolution and Y, in pixels for each unit of length."""
DESCRIBING_TAGS = frozenset(
    {DESCRIPTION, MAKE, MODEL, 0x011A, 0x011B, 0x0128, 0x0131, 0x0132, ARTIST, 0x013C, 0x4746, 0x4749, COPYRIGHT}
    | set(range(0x9C9B, 0x9CA0))
)
"""Tags of the first folder that describe the photo, not its file: description, make, model, resolution, software, date,
artist, computer, rating, copyright, and tags of Windows.
"""
TAGS_IN_PIXELS = frozenset({0x9214, 0xA214})
"""Tags that give places in the stored picture."""
UNCALIBRATED = 0xFFFF
MAX_EXIF_BYTES = 65_000
"""Largest Exif that a JPEG holds."""
MAX_PACKET_BYTES = 64 * 2**20
"""Largest XMP: twice the size of a 100 MP camera's sharp picture as base64."""
MAX_ELEMENTS = 20_000
"""Largest number of elements of an XMP packet; real ones have some hundreds."""
MAX_CAPTION_CHARACTERS, MAX_FACT_CHARACTERS = 2000, 60
RDF, XMP_META, OURS = "http://www.w3.org/1999/02/22-rdf-syntax-ns#", "adobe:ns:meta/", "urn:iibr:1.0/"
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
KEPT_NAMESPACES = frozenset(NAMESPACES.values()) - {XMP_META, RDF, OURS}
"""Namespaces of properties that saved pictures keep: author, title, description, keywords, rating and rights."""
DROPPED_NAMES = frozenset({"Thumbnails", "DocumentAncestors", "SidecarForExtension"})
SETTINGS_KEY = "iibr:settings"
"""Name of the text that holds the settings of this program in a saved picture."""
MAX_PLAIN_CHARACTERS = 20_000
"""Longer texts are packed for XMP, as a JPEG holds 64 KB."""
PACKED = "zlib,base64:"
MAX_UNPACKED_BYTES = 4_000_000
PACKET_START, PACKET_END = b'<?xpacket begin="\xef\xbb\xbf" id="W5M0MpCehiHzreSzNTczkc9d"?>\n', b'\n<?xpacket end="w"?>'

Tags = dict[int, Any]
"""Values of Exif by their tags."""


@dataclass(frozen=True, eq=False)
class PictureMetadata:
    """Metadata of a picture.

    exif: as it stands in JPEG files, b"" without. xmp: a packet, b"" without. texts: of this program, by name.
    """

    exif: bytes = b""
    xmp: bytes = b""
    texts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Caption:
    """Texts of one line about a photo, "" where the file has none."""

    title: str = ""
    description: str = ""
    author: str = ""
    rights: str = ""


def read_metadata(path: Path) -> PictureMetadata:
    """Return Exif and XMP of a photo's file; nothing where the file is damaged or missing."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow warns of damaged Exif
            if is_heic(path):
                info = heic_info(path)
                return PictureMetadata(_bytes_of(info.get("exif")), _bytes_of(info.get("xmp")))
            with Image.open(path) as image:
                exif = _bytes_of(image.info.get("exif"))
                if not exif and (stored := image.getexif()):  # a TIFF keeps it in its first folder
                    exif = _exif_of(*_folders_of(stored)).tobytes()
                return PictureMetadata(exif, _bytes_of(image.info.get("xmp")))
    except (InputError, *EXIF_ERRORS):
        return PictureMetadata()


def exif_for(exif: bytes, size: ImageSize, color_space: ColorSpace, keeps_position: bool) -> Image.Exif:
    """Return a photo's Exif, as Pillow's record, for an upright picture of another size; empty where it is damaged."""
    photo, camera, position = _folders_in(exif)
    if photo or camera:
        photo[ORIENTATION_TAG] = 1
    try:
        if camera:
            _set_camera(camera, size, color_space)
        kept = _exif_of(photo, camera, position if keeps_position else {})
        return kept if len(kept.tobytes()) <= MAX_EXIF_BYTES else Image.Exif()
    except EXIF_ERRORS:
        return Image.Exif()


def xmp_for(xmp: bytes, texts: Mapping[str, str]) -> bytes:
    """Return a packet with the kept properties of a photo's XMP, and with texts of ours; b"" where there are none."""
    described = Element(f"{{{RDF}}}Description", {f"{{{RDF}}}about": ""})
    for name, text in texts.items():
        described.set(_key_of(name), _pack(text))
    with suppress(InputError):  # a photo without XMP is a photo, too
        for source in parse_packet(xmp).iter(f"{{{RDF}}}Description") if xmp else ():
            _copy_properties(source, described)
    if len(described) == 0 and len(described.attrib) == 1:
        return b""
    for prefix, uri in NAMESPACES.items():
        ElementTree.register_namespace(prefix, uri)
    root = Element(f"{{{XMP_META}}}xmpmeta")
    SubElement(root, f"{{{RDF}}}RDF").append(described)
    packet: bytes = ElementTree.tostring(root, encoding="utf-8")
    return PACKET_START + packet + PACKET_END


def settings_text_in(path: Path) -> str:
    """Return the text of the settings that a picture was saved with; "" without.

    Raises InputError where the file is no picture, or its settings are damaged.
    """
    read_size(path)
    text, xmp = read_text(path, SETTINGS_KEY), read_metadata(path).xmp
    if not text and OURS.encode() in xmp:
        key = _key_of(SETTINGS_KEY)
        texts = (element.attrib[key] for element in parse_packet(xmp).iter() if key in element.attrib)
        text = next(texts, "")
    return _unpack(text, path)


def read_caption(path: Path) -> Caption:
    """Return the texts about a photo, XMP before Exif; empty where the file is damaged or missing."""
    metadata, tree = read_metadata(path), None
    photo = _folders_in(metadata.exif)[0]
    with suppress(InputError):
        tree = parse_packet(metadata.xmp) if metadata.xmp else None

    def text(name: str, tag: int) -> str:
        texts = (_line(value, MAX_CAPTION_CHARACTERS) for value in (_dublin_core(tree, name), photo.get(tag)))
        return next(filter(None, texts), "")

    tags = {"title": 0, "description": DESCRIPTION, "creator": ARTIST, "rights": COPYRIGHT}
    return Caption(*(text(name, tag) for name, tag in tags.items()))


def camera_facts(metadata: PictureMetadata) -> tuple[tuple[str, str], ...]:
    """Return what Exif states about how a photo was taken, for people: (name, value) of each known fact."""
    photo, camera, _ = _folders_in(metadata.exif)
    maker, model, lens, taken = (
        _line(value, MAX_FACT_CHARACTERS)
        for value in (photo.get(MAKE), photo.get(MODEL), camera.get(0xA434), camera.get(0x9003))
    )
    facts = (
        ("Camera", " ".join(dict.fromkeys(f"{maker} {model}".split()))),
        ("Lens", lens),
        ("Exposure", ", ".join(filter(None, _exposure(camera)))),
        ("Taken", taken[:16].replace(":", "-", 2)),
    )
    return tuple((name, value) for name, value in facts if value)


class _LimitedTree(TreeBuilder):
    """A tree of at most MAX_ELEMENTS elements."""

    count = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise InputError(f"XMP holds more than {MAX_ELEMENTS:,} elements")
        return super().start(tag, attrs)


def parse_packet(packet: bytes) -> Element:
    """Parse an XMP packet without expanding entities.

    Raises InputError where it is no XML, declares a document type, or is too large.
    """
    if len(packet) > MAX_PACKET_BYTES:
        raise InputError(f"XMP of {len(packet):,} bytes exceeds {MAX_PACKET_BYTES:,}")
    parser = DefusedXMLParser(target=_LimitedTree(), forbid_dtd=True)
    try:
        parser.feed(packet.strip(b"\0 \t\r\n"))
        tree: Element = parser.close()
        return tree
    except InputError:
        raise
    except DTDForbidden as error:
        raise InputError("XMP declares a document type; entities are not expanded") from error
    except (ParseError, AssertionError, ValueError, LookupError) as error:  # LookupError: of an encoding
        raise InputError(f"XMP is damaged ({error})") from error


def value_in(tree: Element, namespace: str, name: str) -> str | None:
    """Return the first value of a property in a tree, its root included, as attribute or element; None without."""
    key = f"{{{namespace}}}{name}"
    for element in tree.iter():
        if key in element.attrib:
            return element.attrib[key]
        if element.tag == key:
            return "".join(element.itertext())
    return None


def _bytes_of(value: Any) -> bytes:
    return value.encode() if isinstance(value, str) else bytes(value or b"")


def _folders_in(exif: bytes) -> tuple[Tags, Tags, Tags]:
    """Return what describes the photo, its camera and its place, from Exif as JPEGs have it; empty where damaged."""
    stored = Image.Exif()
    with suppress(*EXIF_ERRORS), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stored.load(exif)
        return _folders_of(stored)
    return {}, {}, {}


def _folders_of(exif: Image.Exif) -> tuple[Tags, Tags, Tags]:
    photo = {tag: exif[tag] for tag in sorted(DESCRIBING_TAGS & set(exif))}
    return photo, dict(exif.get_ifd(EXIF_FOLDER)), dict(exif.get_ifd(GPS_FOLDER))


def _exif_of(photo: Tags, camera: Tags, position: Tags) -> Image.Exif:
    exif = Image.Exif()
    exif.update(photo)
    for number, folder in ((EXIF_FOLDER, camera), (GPS_FOLDER, position)):
        if folder:
            exif.get_ifd(number).update(folder)
    return exif


def _set_camera(camera: Tags, size: ImageSize, color_space: ColorSpace) -> None:
    """Change the camera's tags that depend on the picture's size and colours, and drop those that no longer fit."""
    for tag in (MAKER_NOTE, INTEROPERABILITY, *TAGS_IN_PIXELS):
        camera.pop(tag, None)
    width_before = camera.get(WIDTH)
    for tag in RESOLUTION_TAGS:
        if tag in camera and isinstance(width_before, int) and width_before > 0:
            # The longer sides are compared: a portrait picture was stored lying on its side.
            camera[tag] = float(camera[tag]) * max(size) / max(width_before, camera.get(HEIGHT) or 0)
        else:
            camera.pop(tag, None)
    camera[WIDTH], camera[HEIGHT] = size.width, size.height
    camera[COLOR_SPACE] = 1 if color_space == SRGB else UNCALIBRATED


def _copy_properties(source: Element, target: Element) -> None:
    for name, value in source.attrib.items():
        if _is_kept(name) and name not in target.attrib:
            target.set(name, value)
    known = {child.tag for child in target}
    target.extend(child for child in source if _is_kept(child.tag) and child.tag not in known)


def _is_kept(name: str) -> bool:
    namespace, _, local = name[1:].partition("}")
    return name.startswith("{") and namespace in KEPT_NAMESPACES and local not in DROPPED_NAMES


def _key_of(name: str) -> str:
    """Return the XML name of a text of ours, as of "iibr:settings"."""
    return f"{{{OURS}}}{name.rpartition(':')[2]}"


def _pack(text: str) -> str:
    if len(text) <= MAX_PLAIN_CHARACTERS:
        return text
    return PACKED + base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")


def _unpack(text: str, path: Path) -> str:
    if not text.startswith(PACKED):
        return text
    try:
        packed = zlib.decompressobj()
        return packed.decompress(base64.b64decode(text[len(PACKED) :]), MAX_UNPACKED_BYTES).decode()
    except (ValueError, binascii.Error, zlib.error) as error:
        raise InputError(f"{path}: its settings are damaged; set them by hand") from error


def _dublin_core(tree: Element | None, name: str) -> str:
    """Return the first text of a property of Dublin Core, of a list its first entry."""
    for element in () if tree is None else tree.iter(f"{{{NAMESPACES['dc']}}}{name}"):
        texts = [entry.text for entry in element.iter(f"{{{RDF}}}li")] or [element.text]
        if text := next(filter(None, texts), "").strip():
            return text
    return ""


def _line(text: Any, max_characters: int) -> str:
    """Return a text as one line without control characters; "" for other values."""
    if not isinstance(text, str):
        return ""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:max_characters]


def _exposure(camera: Mapping[int, Any]) -> tuple[str, ...]:
    """Return F-number, time, sensitivity and focal length, "" for unknown ones."""
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
    """Return a number of Exif; 0 where it is none, or makes no sense."""
    try:
        number = float(value[0] if isinstance(value, tuple) else value)
    except EXIF_ERRORS:
        return 0.0
    return number if math.isfinite(number) and 0 < number < 1e9 else 0.0
