"""Boxes of ISO base media files (ISO/IEC 14496-12), which AVIF and HEIC files consist of."""

import struct
from collections.abc import Iterator


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


def meta_boxes(file: bytes) -> dict[bytes, bytes]:
    """Return the boxes that describe a file's items by their kinds. Raises KeyError where the file has none."""
    return dict(boxes(dict(boxes(file))[b"meta"][4:]))


def with_primary(file: bytes, item: int) -> bytes:
    """Return a file that shows this item as its photo. Raises KeyError and OverflowError where it cannot."""
    primary = meta_boxes(file)[b"pitm"]
    shown = primary[:4] + item.to_bytes(len(primary) - 4, "big")
    return file.replace(box(b"pitm", primary), box(b"pitm", shown), 1)


def associations(ipma: bytes) -> tuple[dict[int, list[int]], int]:
    """Return the numbers of each item's properties, counted from 1, and the bit that marks essential ones.

    ipma: content of the box (ISO/IEC 23008-12). Damaged ones raise IndexError or struct.error.
    """
    item_form, item_bytes = (">H", 2) if ipma[0] < 1 else (">I", 4)
    size = 2 if ipma[3] & 1 else 1
    (count,), at = struct.unpack_from(">I", ipma, 4), 8
    numbers = {}
    for _ in range(count):
        (item,), held = struct.unpack_from(item_form, ipma, at), ipma[at + item_bytes]
        at += item_bytes + 1
        numbers[item] = [int.from_bytes(ipma[k : k + size], "big") for k in range(at, at + size * held, size)]
        at += size * held
    return numbers, 1 << (8 * size - 1)
