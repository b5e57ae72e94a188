"""Kinds of the further channels of a JPEG XL picture, from its header (ISO/IEC 18181-1, annex D).

OpenImageIO reads colours and alpha alone.
"""

from collections.abc import Iterator
from pathlib import Path

from iibr_core.formats.files import read_bytes
from iibr_core.formats.images.iso_boxes import boxes

CODESTREAM, CONTAINER = b"\xff\x0a", b"\0\0\0\x0cJXL "
HEADER_BYTES = 1 << 16
DEPTH = 1
"""Number of a channel of depth among the kinds of further channels."""
ALPHA, SPOT_COLOR, COLOR_FILTER = 0, 2, 5
Choice = tuple[int, int]
"""Number of bits and the number that is added to them."""
SIZE: tuple[Choice, ...] = ((9, 1), (13, 1), (18, 1), (30, 1))
PREVIEW = ((6, 1), (8, 65), (10, 321), (12, 1345))
PREVIEW_EIGHTHS = ((0, 16), (0, 32), (5, 1), (9, 33))
ENUM = ((0, 0), (0, 1), (4, 2), (6, 18))


def has_depth_channel(path: Path) -> bool:
    """Return whether a file is JPEG XL with a channel of depth; False where its header is damaged."""
    data = read_bytes(path, HEADER_BYTES)
    if data.startswith(CONTAINER):
        parts = ((kind, content) for kind, content in _whole_and_cut_boxes(data) if kind in (b"jxlc", b"jxlp"))
        data = next((content[4:] if kind == b"jxlp" else content for kind, content in parts), b"")
    try:
        return data.startswith(CODESTREAM) and DEPTH in _extra_channels(_Bits(data[2:]))
    except EOFError:
        return False


class _Bits:
    """Reads numbers from a header, whose first bit is the lowest."""

    def __init__(self, data: bytes) -> None:
        self.number, self.left = int.from_bytes(data[:4096], "little"), 8 * min(len(data), 4096)

    def take(self, count: int) -> int:
        """Return the number of the next bits. Raises EOFError at the end."""
        if count > self.left:
            raise EOFError
        value = self.number & ((1 << count) - 1)
        self.number, self.left = self.number >> count, self.left - count
        return value

    def choose(self, *choices: Choice) -> int:
        """Return a number in the one of four forms that the next two bits state."""
        bits, added = choices[self.take(2)]
        return self.take(bits) + added


def _extra_channels(bits: _Bits) -> list[int]:
    _skip_size(bits, SIZE, None)
    if bits.take(1):
        return []
    if bits.take(1):
        bits.take(3)  # orientation
        if bits.take(1):
            _skip_size(bits, SIZE, None)
        if bits.take(1):
            _skip_size(bits, PREVIEW, PREVIEW_EIGHTHS)
        if bits.take(1):  # animation
            bits.choose((0, 100), (0, 1000), (10, 1), (30, 1))
            bits.choose((0, 1), (0, 1001), (8, 1), (10, 1))
            bits.choose((0, 0), (3, 0), (16, 0), (32, 0))
            bits.take(1)
    _skip_sample(bits)
    bits.take(1)
    return [_extra_channel(bits) for _ in range(bits.choose((0, 0), (0, 1), (4, 2), (12, 1)))]


def _extra_channel(bits: _Bits) -> int:
    if bits.take(1):
        return ALPHA
    kind = bits.choose(*ENUM)
    _skip_sample(bits)
    bits.choose((0, 0), (0, 3), (0, 4), (3, 1))
    bits.take(8 * bits.choose((0, 0), (4, 0), (5, 16), (10, 48)))  # its name
    bits.take({ALPHA: 1, SPOT_COLOR: 64}.get(kind, 0))
    if kind == COLOR_FILTER:
        bits.choose((0, 1), (2, 0), (4, 3), (8, 19))
    return kind


def _skip_size(bits: _Bits, choices: tuple[Choice, ...], eighths: tuple[Choice, ...] | None) -> None:
    in_eighths = bits.take(1)
    for axis in range(2):
        if axis == 1 and bits.take(3):  # the width by the aspect ratio
            return
        if in_eighths and eighths is None:
            bits.take(5)
        else:
            bits.choose(*(eighths if in_eighths and eighths else choices))


def _skip_sample(bits: _Bits) -> None:
    if bits.take(1):
        bits.choose((0, 32), (0, 16), (0, 24), (6, 1))
        bits.take(4)
    else:
        bits.choose((0, 8), (0, 10), (0, 12), (6, 1))


def _whole_and_cut_boxes(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the boxes of the start of a file; the last one reaches beyond it."""
    at = sum(8 + len(content) for _, content in boxes(data))
    yield from boxes(data)
    yield data[at + 4 : at + 8], data[at + 8 :]
