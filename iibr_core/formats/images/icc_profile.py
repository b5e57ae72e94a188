"""Colour profiles (ICC.1:2022, version 4) of the spaces that pictures are saved in, made here: some hundred bytes."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from functools import cache

import numpy as np

from iibr_core.types import ColorSpace

D50 = (0.9642, 1.0, 0.8249)
D50_FROM_D65 = (1.0478112, 0.0228866, -0.0501270, 0.0295424, 0.9904844, -0.0170491, -0.0092345, 0.0150436, 0.7521316)
"""Bradford's: what the spaces' own white became (annex E)."""
CURVE = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
"""sRGB's, as a formula of kind 3 (clause 10.18)."""
COPYRIGHT = "No copyright, use freely"
HEADER_BYTES, ENTRY_BYTES = 128, 12


@cache
def icc_profile(space: ColorSpace) -> bytes:
    """The profile of a space under D65 with sRGB's curve, named as the space is."""
    curve = b"para" + bytes(4) + struct.pack(">HH", 3, 0) + _fixed(CURVE)
    columns = np.array(space.xyz_from_linear).T.tolist()
    tags = {
        b"desc": _text(space.name),
        b"cprt": _text(COPYRIGHT),
        b"wtpt": _xyz(D50),
        b"chad": b"sf32" + bytes(4) + _fixed(D50_FROM_D65),
        **{f"{name}XYZ".encode(): _xyz(column) for name, column in zip("rgb", columns)},
        **{f"{name}TRC".encode(): curve for name in "rgb"},
    }
    table, body = struct.pack(">I", len(tags)), b""
    first = HEADER_BYTES + 4 + ENTRY_BYTES * len(tags)
    for name, data in tags.items():
        table += struct.pack(">4sII", name, first + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    return _header(first + len(body)) + table + body


def _header(size: int) -> bytes:
    """Of a profile for screens, made on no day in particular, so that it is the same every time (clause 7.2)."""
    made = struct.pack(">6H", 2022, 1, 1, 0, 0, 0)
    start = struct.pack(">I4sI4s4s4s", size, b"", 0x04400000, b"mntr", b"RGB ", b"XYZ ") + made + b"acsp"
    return (start + bytes(28) + _fixed(D50)).ljust(HEADER_BYTES, b"\0")


def _fixed(values: Iterable[float]) -> bytes:
    """Numbers with 16 bits before and 16 after the point (clause 4.6)."""
    return b"".join(struct.pack(">i", round(65536 * value)) for value in values)


def _xyz(values: Iterable[float]) -> bytes:
    return b"XYZ " + bytes(4) + _fixed(values)


def _text(text: str) -> bytes:
    encoded = text.encode("utf-16-be")
    return b"mluc" + bytes(4) + struct.pack(">II4sII", 1, 12, b"enUS", len(encoded), 28) + encoded
