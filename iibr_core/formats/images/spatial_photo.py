"""Writes spatial photos: HEIC files of a left and a right picture, which headsets show in depth.

pillow-heif encodes the pictures. This module adds the boxes that make them a pair: a `ster` group and the cameras of
both (ISO/IEC 23008-12, amendment 2 of 2024).
"""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path
from uuid import UUID

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.formats.files import reason_of
from iibr_core.formats.images.iso_boxes import box, boxes
from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError

QUALITY = 92
INTRINSICS = UUID("22cc04c7-d6d9-4e07-9d90-4eb6ecbaf3a3").bytes
EXTRINSICS = UUID("4363e914-5b7d-4aab-97ae-bea69803b434").bytes
ADJUSTMENT = UUID("de225085-36cb-4365-8743-2f875e7c788a").bytes
SHIFT = 30
"""Number of binary places of the intrinsics, which are integers."""
DISPARITY_ADJUSTMENT = 293
"""Distance by which the pictures are moved apart where they are shown, in ten-thousandths of the width."""
EYES_APART_UM = 63_000


def write_spatial_photo(path: Path, left: NDArray[np.uint8], right: NDArray[np.uint8], focal_px: float) -> None:
    """Write two sRGB-encoded pictures (H, W, 3), whole or not at all. focal_px: focal length of both, in pixels.

    Raises InputError where the pictures differ in size, or the file cannot be written.
    """
    if left.shape != right.shape:
        raise InputError(f"{path}: the left picture is {left.shape}, the right one {right.shape}; give one size")
    try:
        stored = _with_pair(_encode(path, left, right), focal_px / left.shape[1])
    except (ValueError, KeyError, IndexError, struct.error) as error:
        if isinstance(error, InputError):
            raise
        reason = reason_of(error)
        raise InputError(f"{path}: cannot be written as a spatial photo ({reason}); update pillow-heif") from error
    with write_file(path) as temporary:
        temporary.write_bytes(stored)


def _encode(path: Path, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> bytes:
    import pillow_heif

    try:
        file = pillow_heif.from_pillow(Image.fromarray(np.ascontiguousarray(left)))
        file.add_from_pillow(Image.fromarray(np.ascontiguousarray(right)))
        stored = BytesIO()
        file.save(stored, quality=QUALITY, chroma=444, primary_index=0)
    except (ValueError, OSError, RuntimeError, MemoryError) as error:
        raise InputError(f"{path}: cannot be encoded as HEIC ({reason_of(error)}); try another size") from error
    return stored.getvalue()


def _with_pair(file: bytes, focal: float) -> bytes:
    """Return a HEIC file with the boxes of a pair. focal: focal length as a share of the width."""
    top = dict(boxes(file))
    meta = dict(boxes(top[b"meta"][4:]))
    iprp = dict(boxes(meta[b"iprp"]))
    left, right = (item for item, _ in _associations(iprp[b"ipma"]))
    known = sum(1 for _ in boxes(iprp[b"ipco"]))
    # Properties are counted from 1, in their order.
    new = [
        _intrinsics(focal),
        _extrinsics(None),
        _extrinsics(EYES_APART_UM),
        _uuid(ADJUSTMENT, 0, DISPARITY_ADJUSTMENT),
    ]
    added = {left: (1, 2, 4), right: (1, 3, 4)}
    entries = [(item, [*held, *(known + i for i in added[item])]) for item, held in _associations(iprp[b"ipma"])]
    iprp[b"ipco"] += b"".join(new)
    iprp[b"ipma"] = _ipma(entries)
    meta[b"iprp"] = b"".join(box(kind, content) for kind, content in iprp.items())
    group = struct.pack(">IIIII", 0, max(left, right) + 1, 2, left, right)
    meta[b"grpl"] = box(b"ster", group)
    moved = len(_meta(top[b"meta"], meta)) - len(top[b"meta"])
    meta[b"iloc"] = _moved_iloc(meta[b"iloc"], moved)
    top[b"meta"] = _meta(top[b"meta"], meta)
    return b"".join(box(kind, content) for kind, content in top.items())


def _meta(before: bytes, contents: dict[bytes, bytes]) -> bytes:
    return before[:4] + b"".join(box(kind, content) for kind, content in contents.items())


def _uuid(kind: bytes, flags: int, *numbers: int) -> bytes:
    return box(b"uuid", kind + struct.pack(f">I{len(numbers)}i", flags, *numbers))


def _intrinsics(focal: float) -> bytes:
    """Return a box of focal length and principal point, the middle, as shares of the picture."""
    most = (1 << 31) - 1
    return _uuid(INTRINSICS, SHIFT << 8, min(round(focal * (1 << SHIFT)), most), 1 << (SHIFT - 1), 1 << (SHIFT - 1))


def _extrinsics(x_um: int | None) -> bytes:
    """Return a box of a camera's place: the left one is the origin, None, the right one stands beside it."""
    return _uuid(EXTRINSICS, 0) if x_um is None else _uuid(EXTRINSICS, 1, x_um)


def _associations(ipma: bytes) -> list[tuple[int, list[int]]]:
    """Return the properties of each item, as pillow-heif writes them: version 0, a byte each."""
    flags, count = struct.unpack_from(">II", ipma)
    if flags:
        raise ValueError(f"ipma of version and flags {flags:#x} is unknown")
    entries, at = [], 8
    for _ in range(count):
        item, held = struct.unpack_from(">HB", ipma, at)
        entries.append((item, list(ipma[at + 3 : at + 3 + held])))
        at += 3 + held
    return entries


def _ipma(entries: list[tuple[int, list[int]]]) -> bytes:
    items = [struct.pack(">HB", item, len(held)) + bytes(held) for item, held in entries]
    return struct.pack(">II", 0, len(entries)) + b"".join(items)


def _moved_iloc(iloc: bytes, moved: int) -> bytes:
    """Return the places of items in the file moved by `moved` bytes.

    pillow-heif writes version 0, sizes of 4 bytes, absolute base offsets.
    """
    flags, sizes, count = struct.unpack_from(">IHH", iloc)
    if (flags, sizes) != (0, 0x4440):
        raise ValueError(f"iloc of version {flags >> 24} with sizes {sizes:#x} is unknown")
    stored, at = bytearray(iloc), 8
    for _ in range(count):
        base, extents = struct.unpack_from(">IH", stored, at + 4)
        struct.pack_into(">I", stored, at + 4, base + moved)
        at += 10 + 8 * extents
    return bytes(stored)
