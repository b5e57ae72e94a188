"""XMP in JPEG files: found in the file's segments and put together.

Large values (a depth map in base64) do not fit a segment of 64 KB: they stand in an "extended" packet that is cut into
parts, XMP specification part 3, section 1.1.3.1.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

from iibr_core.formats.images.xmp import MAX_PACKET_BYTES, parse_packet, value_in
from iibr_core.types import InputError

STANDARD_HEADER = b"http://ns.adobe.com/xap/1.0/\0"
EXTENDED_HEADER = b"http://ns.adobe.com/xmp/extension/\0"
GUID_BYTES = 32
NOTE = "http://ns.adobe.com/xmp/note/"
APP1, START_OF_SCAN, END_OF_IMAGE = 0xE1, 0xDA, 0xD9
# Markers without a length: TEM, restarts, start of image.
STANDALONE = frozenset({0x01, *range(0xD0, 0xD9)})
# Within a scan 0xFF is followed by a stuffed 0 or a restart marker; anything else ends it.
AFTER_SCAN = re.compile(rb"\xff+[^\x00\xff\xd0-\xd7]")


@dataclass(frozen=True, eq=False)
class JpegLayout:
    """Where things are in a JPEG file.

    xmp: the standard packet, b"" without. extended: parts of extended packets by GUID, each (offset, whole length,
    bytes). end: first byte after the picture; what follows is a trailer.
    """

    xmp: bytes
    extended: Mapping[bytes, list[tuple[int, int, bytes]]]
    end: int


def is_jpeg(data: bytes) -> bool:
    """Whether the bytes begin as a JPEG file does."""
    return data[:3] == b"\xff\xd8\xff"


def jpeg_layout(data: bytes, start: int = 0) -> JpegLayout:
    """Walk the segments of the JPEG picture that begins at `start`. Where it is cut off, `end` is the data's end."""
    xmp = b""
    extended: dict[bytes, list[tuple[int, int, bytes]]] = {}
    end = len(data)
    for marker, first, last in _segments(data, start):
        if marker == END_OF_IMAGE:
            end = last
        elif marker == APP1 and data.startswith(STANDARD_HEADER, first, last):
            xmp = xmp or data[first + len(STANDARD_HEADER) : last]
        elif marker == APP1 and data.startswith(EXTENDED_HEADER, first, last):
            guid, part = _extended_part(data[first + len(EXTENDED_HEADER) : last])
            extended.setdefault(guid, []).append(part)
    return JpegLayout(xmp, extended, end)


def _segments(data: bytes, start: int) -> Iterator[tuple[int, int, int]]:
    """Each segment's marker and where its content begins and ends; the last is the end of the image."""
    at = start + 2
    while at + 2 <= len(data):
        if data[at] != 0xFF:
            return
        marker = data[at + 1]
        if marker == 0xFF:  # padding
            at += 1
        elif marker == END_OF_IMAGE:
            yield marker, at, at + 2
            return
        elif marker in STANDALONE:
            at += 2
        else:
            length = int.from_bytes(data[at + 2 : at + 4], "big")
            last = at + 2 + length
            if length < 2 or last > len(data):
                return
            yield marker, at + 4, last
            at = last
            if marker == START_OF_SCAN:
                found = AFTER_SCAN.search(data, at)
                if found is None:
                    return
                at = found.end() - 2


def _extended_part(content: bytes) -> tuple[bytes, tuple[int, int, bytes]]:
    guid, rest = content[:GUID_BYTES], content[GUID_BYTES:]
    whole, offset = int.from_bytes(rest[:4], "big"), int.from_bytes(rest[4:8], "big")
    return guid.upper(), (offset, whole, rest[8:])


@dataclass(frozen=True, eq=False)
class Xmp:
    """The parsed packets of one picture. trees: the standard one first, then the extended one if there is any."""

    trees: tuple[Element, ...] = field(default=())

    def value(self, namespace: str, name: str) -> str | None:
        """The first value of a property, given as an attribute or as an element's text, anywhere; None without."""
        return next((found for tree in self.trees if (found := value_in(tree, namespace, name)) is not None), None)

    def elements(self, namespaces: tuple[str, ...], name: str) -> Iterator[Element]:
        """All elements of this name in one of the namespaces."""
        for tree in self.trees:
            for namespace in namespaces:
                yield from tree.iter(f"{{{namespace}}}{name}")


def number_in(text: str | None) -> float:
    """The number that a value states; NaN where there is none."""
    try:
        return float(text or "")
    except ValueError:
        return math.nan


def xmp_of(layout: JpegLayout) -> Xmp:
    """Parse a JPEG's XMP, the extended packet that the standard one names included.

    Raises InputError where a packet is damaged, absurdly large, declares entities, or lacks parts.
    """
    if not layout.xmp:
        return Xmp()
    standard = parse_packet(layout.xmp)
    guid = value_in(standard, NOTE, "HasExtendedXMP")
    if guid is None:
        return Xmp((standard,))
    parts = layout.extended.get(guid.strip().upper().encode("ascii", "replace"), [])
    return Xmp((standard, parse_packet(_join_parts(parts))))


def _join_parts(parts: list[tuple[int, int, bytes]]) -> bytes:
    """An extended packet from its parts, whatever their order in the file."""
    if not parts:
        raise InputError("extended XMP is missing")
    whole = parts[0][1]
    if whole > MAX_PACKET_BYTES:
        raise InputError(f"extended XMP of {whole:,} bytes exceeds {MAX_PACKET_BYTES:,}")
    packet = bytearray()
    for offset, _, content in sorted(parts, key=lambda part: part[0]):
        if offset > len(packet):
            break
        packet[offset : offset + len(content)] = content
    if len(packet) != whole:
        raise InputError(f"extended XMP is cut short ({len(packet):,} of {whole:,} bytes)")
    return bytes(packet)
