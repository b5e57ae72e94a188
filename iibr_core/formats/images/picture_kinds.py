"""Kinds of pictures that can be saved, by the ending of the name, and the options for writing them.

Imports no library of pictures: the window asks for them before anything is loaded.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from iibr_core.types import DISPLAY_P3, SRGB, ColorSpace, ImageSize, InputError

BEST_QUALITY = 100
PROFILES = {"srgb": SRGB, "p3": DISPLAY_P3}
"""Colour spaces of saved pictures by the names that people type."""
PNG_SETTINGS: Mapping[str, str | int | float] = {"png:compressionLevel": 1, "png:filter": 64}
"""Level 1 is 8 times faster than the default 6, 10 % larger; filter 64 is the average."""


@dataclass(frozen=True)
class PictureKind:
    """A kind of picture files.

    bits: numbers of bits of a channel, the usual one first. has_quality: whether a lower quality makes smaller files.
    is_linear: whether it holds light, not values encoded by sRGB's curve. max_side_px: 0 where there is no limit.
    """

    name: str
    bits: tuple[int, ...]
    has_quality: bool = False
    is_linear: bool = False
    max_side_px: int = 0


_JPEG = PictureKind("JPEG", (8,), has_quality=True, max_side_px=65_500)
_TIFF = PictureKind("TIFF", (16, 8))
KINDS = {
    ".png": PictureKind("PNG", (8, 16)),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".exr": PictureKind("OpenEXR", (32, 16), is_linear=True),
    ".webp": PictureKind("WebP", (8,), has_quality=True, max_side_px=16_383),
    ".avif": PictureKind("AVIF", (8,), has_quality=True, max_side_px=65_536),
}
"""Kinds of saved pictures by the ending of the name."""


@dataclass(frozen=True)
class PictureFormat:
    """Options for writing a picture.

    bits: of a channel, None for the kind's usual number. quality: 1 to 100, for kinds that have it. color_space: None
    for the photo's, as far as Display P3 holds it. keeps_position: whether the place of the photo stays in the file.
    """

    bits: int | None = None
    quality: int = 95
    color_space: ColorSpace | None = None
    keeps_position: bool = False

    def space_for(self, photo: ColorSpace) -> ColorSpace:
        """Return the colour space in which a photo of the given space is saved."""
        return self.color_space or (SRGB if photo == SRGB else DISPLAY_P3)

    def bits_for(self, path: Path) -> int:
        """Return the bits of a channel for a file."""
        kind = picture_kind(path)
        bits = kind.bits[0] if self.bits is None else self.bits
        if bits not in kind.bits:
            known = " or ".join(map(str, sorted(kind.bits)))
            more = " (.png and .tif hold 16)" if bits == 16 else ""
            raise InputError(f"{path}: {kind.name} is written with {known} bits a channel, not {bits}{more}")
        return bits


AS_USUAL = PictureFormat()


def picture_kind(path: Path) -> PictureKind:
    """Return the kind of a file by its ending."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: can be written as {', '.join(KINDS)} only")
    return kind


def require_picture_format(path: Path, form: PictureFormat, size: ImageSize | None = None) -> None:
    """Raise InputError where a picture cannot be written with these options. size: None where it is not known yet."""
    form.bits_for(path)
    if not 1 <= form.quality <= BEST_QUALITY:
        raise InputError(f"quality {form.quality}: give 1 to {BEST_QUALITY}")
    kind = picture_kind(path)
    if size is not None and 0 < kind.max_side_px < max(size):
        raise InputError(f"{path}: {size} px; {kind.name} holds {kind.max_side_px} a side: save it as .png or .tif")


def is_float(path: Path, form: PictureFormat = AS_USUAL) -> bool:
    """Return whether a file gets more than 8 bits a channel: linear light is drawn for it."""
    return form.bits_for(path) > 8
