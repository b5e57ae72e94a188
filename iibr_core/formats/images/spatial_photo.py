"""Writes spatial photos: HEIC files of a left and a right picture, which headsets show in depth.

pillow-heif encodes the pictures as Apple's are: 4:2:0, Main Still Picture profile, no `clap` from 64 pixels a side on.
This module adds the boxes that make them a pair: a `ster` group and the cameras of both (ISO/IEC 23008-12, amendment 2
of 2024).
"""

import struct
from io import BytesIO
from pathlib import Path
from uuid import UUID

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.formats.animations import require_even
from iibr_core.formats.files import parsing
from iibr_core.formats.images.iso_boxes import associations, box, boxes, joined, meta_boxes
from iibr_core.formats.images.metadata import PictureMetadata, exif_for
from iibr_core.formats.images.xmp import xmp_for
from iibr_core.formats.outputs import write_file
from iibr_core.types import SRGB, InputError, image_size

NO_METADATA = PictureMetadata()
QUALITY = 92
INTRINSICS = UUID("22cc04c7-d6d9-4e07-9d90-4eb6ecbaf3a3").bytes
EXTRINSICS = UUID("4363e914-5b7d-4aab-97ae-bea69803b434").bytes
ADJUSTMENT = UUID("de225085-36cb-4365-8743-2f875e7c788a").bytes
SHIFT = 30
"""Number of binary places of the intrinsics, which are integers."""
DISPARITY_ADJUSTMENT = 293
"""Distance by which the pictures are moved apart where they are shown, in ten-thousandths of the width."""
EYES_APART_UM = 63_000


def write_spatial_photo(
    path: Path,
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    focal_px: float,
    metadata: PictureMetadata = NO_METADATA,
) -> None:
    """Write two sRGB-encoded pictures (H, W, 3), even sizes, whole or not at all.

    focal_px: focal length of both, in pixels. metadata: that of the photo, kept as in other saved pictures.
    """
    import pillow_heif

    if left.shape != right.shape:
        raise InputError(f"{path}: the left picture is {left.shape}, the right one {right.shape}; give one size")
    require_even(path, image_size(left))
    with parsing(path, "cannot be encoded as a spatial photo ({})"):
        file = pillow_heif.from_pillow(Image.fromarray(np.ascontiguousarray(left)))
        file.add_from_pillow(Image.fromarray(np.ascontiguousarray(right)))
        encoded = BytesIO()
        exif = exif_for(metadata.exif, image_size(left), SRGB, keeps_position=False)
        kept = {"exif": exif.tobytes() if exif else None, "xmp": xmp_for(metadata.xmp, {}) or None}
        file.save(encoded, quality=QUALITY, chroma=420, primary_index=0, **kept)
        stored = _with_pair(encoded.getvalue(), focal_px / left.shape[1])
    with write_file(path) as temporary:
        temporary.write_bytes(stored)


def _with_pair(file: bytes, focal: float) -> bytes:
    """Return a HEIC file with the boxes of a pair. focal: focal length as a share of the width."""
    top = dict(boxes(file))
    head, meta = top[b"meta"][:4], meta_boxes(file)
    iprp = dict(boxes(meta[b"iprp"]))
    entries, _ = associations(iprp[b"ipma"])
    left, right = entries
    (items_count,) = struct.unpack_from(">H", meta[b"iloc"], 6)  # ids of groups differ from those of items
    first = sum(1 for _ in boxes(iprp[b"ipco"])) + 1  # properties are counted from 1, in their order
    entries[left] += [first, first + 1, first + 3]
    entries[right] += [first, first + 2, first + 3]
    middle = 1 << (SHIFT - 1)
    iprp[b"ipco"] += b"".join(
        (
            _uuid(INTRINSICS, SHIFT << 8, min(round(focal * (1 << SHIFT)), (1 << 31) - 1), middle, middle),
            _uuid(EXTRINSICS, 0),  # the left camera is the origin
            _uuid(EXTRINSICS, 1, EYES_APART_UM),
            _uuid(ADJUSTMENT, 0, DISPARITY_ADJUSTMENT),
        )
    )
    items = [struct.pack(">HB", item, len(numbers)) + bytes(numbers) for item, numbers in entries.items()]
    iprp[b"ipma"] = struct.pack(">II", 0, len(items)) + b"".join(items)
    meta[b"iprp"] = joined(iprp)
    meta[b"grpl"] = box(b"ster", struct.pack(">IIIII", 0, max(left, right) + items_count, 2, left, right))
    meta[b"iloc"] = _moved_iloc(meta[b"iloc"], 4 + len(joined(meta)) - len(top[b"meta"]))
    top[b"meta"] = head + joined(meta)
    return joined(top)


def _uuid(kind: bytes, flags: int, *numbers: int) -> bytes:
    return box(b"uuid", kind + struct.pack(f">I{len(numbers)}i", flags, *numbers))


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
