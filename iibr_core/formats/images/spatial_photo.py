"""Spatial photos: HEIC files of two pictures, for the left and the right eye, as headsets show them in depth.

pillow-heif encodes the pictures; what makes two of them a pair, a `ster` group and the cameras of both (ISO/IEC
23008-12, amendment 2 of 2024), is put into the file's boxes here.
"""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path
from uuid import UUID

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import reason_of
from iibr_core.formats.images.iso_boxes import box, boxes
from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError

QUALITY = 92
INTRINSICS = UUID("22cc04c7-d6d9-4e07-9d90-4eb6ecbaf3a3").bytes
EXTRINSICS = UUID("4363e914-5b7d-4aab-97ae-bea69803b434").bytes
ADJUSTMENT = UUID("de225085-36cb-4365-8743-2f875e7c788a").bytes
SHIFT = 30
"""Intrinsics are integers of so many binary places."""
DISPARITY_ADJUSTMENT = 293
"""By so many ten-thousandths of the width the eyes' pictures are moved apart where they are shown."""
EYES_APART_UM = 63_000


def write_spatial_photo(path: Path, left: NDArray[np.uint8], right: NDArray[np.uint8], focal_px: float) -> None:
    """Write two pictures (H, W, 3), sRGB-encoded, whole or not at all. focal_px: of both.

    Raises InputError where it cannot be written, ValueError where they differ in size.
    """
    if left.shape != right.shape:
        raise ValueError(f"the left picture is {left.shape}, the right one {right.shape}")
    stored = _with_pair(_encode(path, left, right), focal_px / left.shape[1])
    with write_file(path) as temporary:
        temporary.write_bytes(stored)


def _encode(path: Path, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> bytes:
    import pillow_heif
    from PIL import Image

    try:
        file = pillow_heif.from_pillow(Image.fromarray(np.ascontiguousarray(left)))
        file.add_from_pillow(Image.fromarray(np.ascontiguousarray(right)))
        stored = BytesIO()
        file.save(stored, quality=QUALITY, chroma=444, primary_index=0)
    except (ValueError, OSError, RuntimeError, MemoryError) as error:
        raise InputError(f"{path}: cannot be encoded as HEIC ({reason_of(error)}); try another size") from error
    return stored.getvalue()


def _with_pair(file: bytes, focal: float) -> bytes:
    """With the pair's boxes. focal: focal length as a share of the width."""
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
    own = {left: (1, 2, 4), right: (1, 3, 4)}
    entries = [(item, [*held, *(known + i for i in own[item])]) for item, held in _associations(iprp[b"ipma"])]
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
    """Focal length and principal point as shares of the picture, its middle."""
    most = (1 << 31) - 1
    return _uuid(INTRINSICS, SHIFT << 8, min(round(focal * (1 << SHIFT)), most), 1 << (SHIFT - 1), 1 << (SHIFT - 1))


def _extrinsics(x_um: int | None) -> bytes:
    """The left camera is where it is; the right one stands beside it."""
    return _uuid(EXTRINSICS, 0) if x_um is None else _uuid(EXTRINSICS, 1, x_um)


def _associations(ipma: bytes) -> list[tuple[int, list[int]]]:
    """The properties of each item, as pillow-heif writes them: version 0, a byte each."""
    flags, count = struct.unpack_from(">II", ipma)
    if flags:
        raise ValueError(f"ipma of version and flags {flags:#x} is not what libheif wrote so far")
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
    """Where items lie in the file, as pillow-heif writes it: version 0, sizes of 4 bytes, absolute base offsets."""
    flags, sizes, count = struct.unpack_from(">IHH", iloc)
    if (flags, sizes) != (0, 0x4440):
        raise ValueError(f"iloc of version {flags >> 24} with sizes {sizes:#x} is not what libheif wrote so far")
    stored, at = bytearray(iloc), 8
    for _ in range(count):
        base, extents = struct.unpack_from(">IH", stored, at + 4)
        struct.pack_into(">I", stored, at + 4, base + moved)
        at += 10 + 8 * extents
    return bytes(stored)
