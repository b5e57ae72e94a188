"""Limits of files with cameras, shared by their readers."""

from typing import NamedTuple

from iibr_core.types import Camera, ImageSize, InputError

MAX_POSES = 10_000
MAX_SIDE_PX = 2**15


class NamedCamera(NamedTuple):
    """A camera and the name of its picture as the file states it, "" where it states none."""

    picture: str
    camera: Camera


def require_count(source: object, count: int) -> None:
    """Raise InputError unless this is a possible number of poses."""
    if not 1 <= count <= MAX_POSES:
        raise InputError(f"{source}: holds {count} poses; give 1 to {MAX_POSES}")


def size_of_pictures(height: float, width: float, source: str) -> ImageSize:
    """Return the size that a camera states for its pictures."""
    if not (1 <= height <= MAX_SIDE_PX and 1 <= width <= MAX_SIDE_PX):
        raise InputError(f"{source}: pictures of {width:g}x{height:g} pixels; give 1 to {MAX_SIDE_PX} each way")
    return ImageSize(round(height), round(width))
