"""One bound on memory: half of what the machine, or the container of this process, has free."""

from __future__ import annotations

import math

from iibr_core.remedies import FixableError, Remedy
from iibr_core.runtime.machine import free_memory_bytes

FREE_SHARE = 0.5
PHOTO_BYTES = 90
"""Bytes a pixel, measured, while a photo is read and its depth is looked for."""
MAKING_BYTES = 300
"""Bytes a pixel while views are made: ten source images of 21 bytes, and views in the making."""
STORED_BYTES, STORED_HDR_BYTES = 7, 10
"""Bytes a pixel of a view: colours of 8 bits or half floats, and disparity."""
MIB = 2**20


def budget_bytes() -> int:
    """Return the memory that this process may take now."""
    return int(FREE_SHARE * free_memory_bytes())


def view_bytes(pixels: int, is_hdr: bool) -> int:
    """Return what one view of a light field takes."""
    return pixels * (STORED_HDR_BYTES if is_hdr else STORED_BYTES)


def scene_bytes(pixels: int, field_bytes: int) -> int:
    """Return the most that a photo of so many pixels takes, from reading it to its last view.

    field_bytes: of the views that are kept.
    """
    return pixels * (PHOTO_BYTES + MAKING_BYTES) + field_bytes


def require_memory(needed_bytes: float, what: str) -> None:
    """Raise InputError where `what` takes more than this process may."""
    allowed = budget_bytes()
    if needed_bytes > allowed:
        raise FixableError(
            f"{what} takes {mebibytes(needed_bytes)}, half of the free memory is {mebibytes(allowed)}", Remedy.SMALLER
        )


def mebibytes(count: float) -> str:
    """Return bytes in words: "24 MiB"."""
    return f"{math.ceil(count / MIB):,} MiB"
