"""A decoded picture, with what its file states about its colours, its orientation and its focal length."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, refuse_bomb
from iibr_core.types import ImageSize, InputError, image_size

CUT_OFF = "The file is cut off: what is missing is grey. Get the whole file again."
"""Note of a picture that was read as far as it goes."""
EXIF_NUMBERS = {
    0x920A: "FocalLength",
    0xA405: "FocalLengthIn35mmFilm",
    0xA20E: "FocalPlaneXResolution",
    0xA210: "FocalPlaneResolutionUnit",
    0xA002: "PixelXDimension",
}
"""Exif tags that the focal length in pixels follows from."""
FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)
"""Diagonal of 35 mm film, which "35 mm equivalent" focal lengths compare (CIPA DCG-001)."""
MM_PER_RESOLUTION_UNIT = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}
"""Length of Exif's FocalPlaneResolutionUnit (Exif 2.3)."""
MIN_FOCAL_DIAGONALS, MAX_FOCAL_DIAGONALS = 0.05, 200.0
"""Range of focal lengths that make sense, as multiples of the picture's diagonal."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture as its file stores it.

    pixels: (H, W, C), C = 1 or 3; uint8 or uint16 as encoded, float32 for every floating-point file: linear light, or
    as its profile states.
    alpha: (H, W) of the same type, None where all is opaque. is_premultiplied: whether `pixels` are multiplied by it.
    orientation: Exif's, 1 to 8; other values count as 1. focal_px: focal length by Exif in stored pixels, 0 where it is
    unknown. wide: (H, W, C) integers of more than 16 bits, or signed ones, as stored, which `pixels` holds scaled to 16
    bits; None for other files. icc: colour profile, b"" without one. codes: colours in numbers (ITU-T H.273), primaries
    and transfer curve first, () without them. chromaticities: x and y of red, green, blue and white as OpenEXR has
    them, () without them. note: for people, on colours that the decoder converted from CMYK or Lab; "" without.
    is_cut_off: whether the file ends before the picture, the rest of which is grey.
    """

    pixels: NDArray[Any]
    alpha: NDArray[Any] | None = None
    is_premultiplied: bool = False
    orientation: int = 1
    focal_px: float = 0.0
    wide: NDArray[Any] | None = None
    icc: bytes = b""
    codes: tuple[int, ...] = ()
    chromaticities: tuple[float, ...] = ()
    note: str = ""
    is_cut_off: bool = False

    @property
    def size(self) -> ImageSize:
        """Height and width of `pixels`."""
        return image_size(self.pixels)

    @property
    def is_float(self) -> bool:
        """True for floating-point numbers, which may exceed white."""
        return bool(self.pixels.dtype.kind == "f")


def is_quarter_turn(orientation: int) -> bool:
    """Return whether Exif's Orientation exchanges height and width."""
    return 5 <= orientation <= 8


def turned_size(size: ImageSize, orientation: int) -> ImageSize:
    """Return the size upright of a picture stored with this size, or the size as stored of an upright one."""
    return ImageSize(size.width, size.height) if is_quarter_turn(orientation) else size


def upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Return stored pixels (H, W, ...) turned by Exif's Orientation; values other than 2 to 8 change nothing."""
    if is_quarter_turn(orientation):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def full_scale(dtype: Any) -> int:
    """Return the value of pixels of this type that is white, or opaque."""
    return int(np.iinfo(dtype).max) if dtype.kind == "u" else 1


def opaque_as_none(alpha: NDArray[Any]) -> NDArray[Any] | None:
    """Return alpha (H, W) as a contiguous array; None where all of it is opaque."""
    return None if (alpha >= full_scale(alpha.dtype)).all() else np.ascontiguousarray(alpha)


def require_sound_size(path: Path, width: int, height: int, decoded_bytes: int) -> None:
    """Raise InputError for a picture without pixels, with too many, or with far more than its file can hold."""
    if width < 1 or height < 1 or width * height > MAX_FILE_PIXELS:
        raise InputError(f"{path}: {width}x{height} exceed {MAX_FILE_PIXELS:,} pixels; make it smaller")
    refuse_bomb(path, decoded_bytes)


def exif_focal_px(exif: Mapping[str, float], size: ImageSize) -> float:
    """Return the focal length in pixels of a stored picture; 0 where Exif's numbers are missing or make no sense.

    exif: numbers by the names in EXIF_NUMBERS.
    """
    known = {name: value for name, value in exif.items() if math.isfinite(value)}
    diagonal_px = math.hypot(*size)
    if (equivalent_mm := known.get("FocalLengthIn35mmFilm", 0.0)) > 0:
        focal_px = equivalent_mm / FILM_DIAGONAL_MM * diagonal_px
    else:
        unit_mm = MM_PER_RESOLUTION_UNIT.get(int(known.get("FocalPlaneResolutionUnit", 0)) or 2, 25.4)
        # The resolution counts pixels of the picture as the camera took it.
        scale = size.width / (known.get("PixelXDimension") or size.width)
        focal_px = known.get("FocalLength", 0.0) * known.get("FocalPlaneXResolution", 0.0) / unit_mm * scale
    is_sound = MIN_FOCAL_DIAGONALS * diagonal_px < focal_px < MAX_FOCAL_DIAGONALS * diagonal_px
    return focal_px if is_sound else 0.0
