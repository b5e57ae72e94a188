"""Boxes of ISO base media files (ISO/IEC 14496-12), which AVIF and HEIC files consist of."""

from __future__ import annotations

import struct
from collections.abc import Iterator

DAMAGE = (KeyError, IndexError, struct.error)
COLOR_CODES_BYTES = 11
"""Size of a `colr` box's content that gives colours in numbers: its type, three numbers of 2 bytes, a flag."""


def boxes(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the kind and content of each box in `content`; a truncated box ends them."""
    at = 0
    while at + 8 <= len(content):
        size, kind = struct.unpack_from(">I4s", content, at)
        header = 8
        if size == 1 and at + 16 <= len(content):
            (size,), header = struct.unpack_from(">Q", content, at + 8), 16
        end = len(content) if size == 0 else at + size
        if not at + header <= end <= len(content):
            return
        yield kind, content[at + header : end]
        at = end


def box(kind: bytes, content: bytes) -> bytes:
    """Return a box with a header of 8 bytes."""
    return struct.pack(">I4s", 8 + len(content), kind) + content


def joined(contents: dict[bytes, bytes]) -> bytes:
    """Return boxes by their kinds in a row."""
    return b"".join(box(kind, content) for kind, content in contents.items())


def color_codes_of(file: bytes) -> tuple[int, int, int, int] | None:
    """Return a picture's colours in numbers (ITU-T H.273): primaries, transfer curve, matrix, full range; None without.

    file: an AVIF or HEIC file, as far as its `meta` box at least. The codes are those of its primary picture.
    """
    try:
        meta = dict(boxes(dict(boxes(file))[b"meta"][4:]))
        (item,) = struct.unpack_from(">I" if meta[b"pitm"][0] else ">H", meta[b"pitm"], 4)
        properties = _item_properties(meta)[item]
    except DAMAGE:
        return None
    for kind, content in properties:
        if kind == b"colr" and content[:4] == b"nclx" and len(content) >= COLOR_CODES_BYTES:
            primaries, transfer, matrix = struct.unpack_from(">HHH", content, 4)
            return primaries, transfer, matrix, content[10] >> 7
    return None


def with_auxiliary_shown(file: bytes, types: tuple[bytes, ...]) -> bytes | None:
    """Return the file with an auxiliary picture of one of these types (`auxC`) in the place of its primary one.

    None where it has no such picture. file: an AVIF or HEIC file, whole.
    """
    try:
        meta = dict(boxes(dict(boxes(file))[b"meta"][4:]))
        pitm = meta[b"pitm"]
        form = ">I" if pitm[0] else ">H"
        for item, properties in _item_properties(meta).items():
            if any(kind == b"auxC" and content[4:].split(b"\0")[0] in types for kind, content in properties):
                shown = pitm[:4] + struct.pack(form, item) + pitm[4 + struct.calcsize(form) :]
                return file.replace(box(b"pitm", pitm), box(b"pitm", shown), 1)
    except DAMAGE:
        pass
    return None


def _associations(ipma: bytes) -> dict[int, list[int]]:
    """Return the numbers of each item's properties, counted from 1 (ISO/IEC 23008-12, `ipma`)."""
    item_form, item_bytes = (">H", 2) if ipma[0] < 1 else (">I", 4)
    size, mask = (2, 0x7FFF) if ipma[3] & 1 else (1, 0x7F)
    (count,), at = struct.unpack_from(">I", ipma, 4), 8
    numbers = {}
    for _ in range(count):
        (item,), held = struct.unpack_from(item_form, ipma, at), ipma[at + item_bytes]
        at += item_bytes + 1
        numbers[item] = [int.from_bytes(ipma[k : k + size], "big") & mask for k in range(at, at + size * held, size)]
        at += size * held
    return numbers


def _item_properties(meta: dict[bytes, bytes]) -> dict[int, list[tuple[bytes, bytes]]]:
    """Return the kind and content of each item's properties."""
    iprp = dict(boxes(meta[b"iprp"]))
    properties = list(boxes(iprp[b"ipco"]))
    return {
        item: [properties[number - 1] for number in numbers if 1 <= number <= len(properties)]
        for item, numbers in _associations(iprp[b"ipma"]).items()
    }
