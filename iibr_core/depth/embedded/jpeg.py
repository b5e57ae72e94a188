"""JPEG files: where a picture ends, its XMP, and the pictures that follow it.

Large values of XMP, such as a depth map in base64, do not fit a segment of 64 KB: an "extended" packet holds them,
cut into parts (XMP specification part 3, section 1.1.3.1).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple
from xml.etree.ElementTree import Element

from iibr_core.formats.files import MAX_PART_BYTES
from iibr_core.formats.images.xmp import parse_packet, value_in
from iibr_core.types import InputError

JPEG_START = b"\xff\xd8\xff"
HEADER_BYTES = 0x10000
"""Largest segment: marks of a picture's use are looked for in this much of its start."""
STANDARD_HEADER = b"http://ns.adobe.com/xap/1.0/\0"
EXTENDED_HEADER = b"http://ns.adobe.com/xmp/extension/\0"
EXTENDED_PART = re.compile(rb"(.{32})(.{4})(.{4})(.*)", re.DOTALL)
"""Name of the packet, its length, place of the part, and the part."""
NOTE = "http://ns.adobe.com/xmp/note/"
MARKER = re.compile(rb"\xff+([^\xff])")
APP1, START_OF_SCAN, END_OF_IMAGE = b"\xe1", b"\xda", b"\xd9"
STANDALONE = re.compile(rb"[\x01\xd0-\xd8]")
"""Markers without a length: TEM, restarts, start of image."""
AFTER_SCAN = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")
"""End of a scan, in which a stuffed 0 or a restart marker follows 0xFF."""


class JpegLayout(NamedTuple):
    """Contents of a JPEG picture.

    xmp: the standard packet, b"" without. extended: contents of the segments of extended packets. end: first byte after
    the picture; what follows is a trailer.
    """

    xmp: bytes
    extended: list[bytes]
    end: int


def jpeg_layout(data: bytes, start: int = 0) -> JpegLayout:
    """Return the layout of the JPEG picture that begins at `start`. If it is cut off, `end` is the data's end."""
    extended: list[bytes] = []
    xmp, at = b"", start + 2
    while found := MARKER.match(data, at):
        marker, at = found[1], found.end()
        if marker == END_OF_IMAGE:
            return JpegLayout(xmp, extended, at)
        if STANDALONE.match(marker):
            continue
        length = int.from_bytes(data[at : at + 2], "big")
        content, at = data[at + 2 : at + length], at + length
        if length < 2 or at > len(data):
            break
        if marker == APP1 and content.startswith(STANDARD_HEADER):
            xmp = xmp or content.removeprefix(STANDARD_HEADER)
        elif marker == APP1 and content.startswith(EXTENDED_HEADER):
            extended.append(content.removeprefix(EXTENDED_HEADER))
        elif marker == START_OF_SCAN:
            after = AFTER_SCAN.search(data, at)
            at = after.start() if after else len(data)
    return JpegLayout(xmp, extended, len(data))


def appended_pictures(data: bytes, end: int) -> Iterator[tuple[bytes, JpegLayout]]:
    """Yield the first eight JPEG pictures that follow a photo, which ends at `end`, and their layouts."""
    for _ in range(8):
        start = data.find(JPEG_START, end)
        if start < 0:
            return
        layout = jpeg_layout(data, start)
        yield data[start : layout.end], layout
        end = layout.end


def xmp_of(layout: JpegLayout) -> Element:
    """Return the parsed XMP of a JPEG, the extended packet included, as children of one element.

    Raises InputError if a packet is damaged, too large, declares entities, or lacks parts.
    """
    xmp = Element("xmp")
    if layout.xmp:
        xmp.append(parse_packet(layout.xmp))
        name = value_in(xmp, NOTE, "HasExtendedXMP")
        if name is not None:
            xmp.append(parse_packet(_join_parts(layout.extended, name.strip().upper().encode("ascii", "replace"))))
    return xmp


def number_in(text: str | None) -> float:
    """Return the number that a text states, NaN if it states none."""
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")


def _join_parts(segments: list[bytes], name: bytes) -> bytes:
    """Return the extended packet of this name from its parts, whatever their order in the file."""
    parts = [part.groups() for part in map(EXTENDED_PART.fullmatch, segments) if part and part[1].upper() == name]
    whole = int.from_bytes(parts[0][1], "big") if parts else 1
    if whole > MAX_PART_BYTES:
        raise InputError(f"extended XMP of {whole:,} bytes exceeds {MAX_PART_BYTES:,}")
    packet = bytearray()
    for _, _, place, content in sorted(parts, key=lambda part: part[2]):
        offset = int.from_bytes(place, "big")
        if offset > len(packet):
            break
        packet[offset : offset + len(content)] = content
    if len(packet) != whole:
        raise InputError(f"extended XMP is missing or cut short ({len(packet):,} of {whole:,} bytes)")
    return bytes(packet)
