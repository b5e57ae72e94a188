"""The kinds of files that pictures are saved as, by the endings of their names, and what is to be said about each.

Light, so that it can be asked before anything is loaded. A new kind is one line here and a function in
`picture_writers`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from iibr_core.types import DISPLAY_P3, SRGB, ColorSpace, ImageSize, InputError

BEST_QUALITY = 100
PROFILES = {"srgb": SRGB, "p3": DISPLAY_P3}
"""What a picture's colours may be saved in, by the names that people type."""


@dataclass(frozen=True)
class PictureKind:
    """bits: of a channel, the usual number first. write: of what in `picture_writers`. has_quality: whether less of it
    makes smaller files. is_linear: whether it holds light, not what is encoded by sRGB's curve. most_side_px: 0: any.
    """

    name: str
    bits: tuple[int, ...]
    write: str
    has_quality: bool = False
    is_linear: bool = False
    most_side_px: int = 0


_JPEG = PictureKind("JPEG", (8,), "write_jpeg", has_quality=True, most_side_px=65_500)
_TIFF = PictureKind("TIFF", (16, 8), "write_tiff")
KINDS = {
    ".png": PictureKind("PNG", (8, 16), "write_png"),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".exr": PictureKind("OpenEXR", (32, 16), "write_exr", is_linear=True),
    ".webp": PictureKind("WebP", (8,), "write_webp", has_quality=True, most_side_px=16_383),
    ".avif": PictureKind("AVIF", (8,), "write_avif", has_quality=True, most_side_px=65_536),
}


@dataclass(frozen=True)
class PictureFormat:
    """How a picture is to be written. bits: of a channel, None: the kind's usual number. quality: 1..100, where the
    kind has that. color_space: None: the photo's, as far as Display P3 holds it. keeps_position: whether the place
    where the photo was taken stays in it.
    """

    bits: int | None = None
    quality: int = 95
    color_space: ColorSpace | None = None
    keeps_position: bool = False

    def space_for(self, photo: ColorSpace) -> ColorSpace:
        """What the colours of a photo of this space are saved in."""
        return self.color_space or (SRGB if photo == SRGB else DISPLAY_P3)

    def bits_for(self, path: Path) -> int:
        """Of a channel of this file. Raises InputError where its kind does not have so many, or is none."""
        kind = picture_kind(path)
        bits = kind.bits[0] if self.bits is None else self.bits
        if bits not in kind.bits:
            there = " or ".join(map(str, sorted(kind.bits)))
            more = " (.png and .tif hold 16)" if bits == 16 else ""
            raise InputError(f"{path}: {kind.name} is written with {there} bits a channel, not {bits}{more}")
        return bits


AS_USUAL = PictureFormat()


def picture_kind(path: Path) -> PictureKind:
    """By the name's ending. Raises InputError for others."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: can be written as {', '.join(KINDS)} only")
    return kind


def require_picture_format(path: Path, form: PictureFormat, size: ImageSize | None = None) -> None:
    """Raise InputError where a picture (of that size, None: not known yet) cannot be written so."""
    form.bits_for(path)
    if not 1 <= form.quality <= BEST_QUALITY:
        raise InputError(f"quality {form.quality}: give 1 to {BEST_QUALITY}")
    most = picture_kind(path).most_side_px
    if size is not None and 0 < most < max(size):
        raise InputError(f"{path}: {size} px; {picture_kind(path).name} holds {most} a side: save it as .png or .tif")


def is_float(path: Path, form: PictureFormat = AS_USUAL) -> bool:
    """Whether more than 8 bits a channel are written: such pictures are drawn as linear light. Raises InputError."""
    return form.bits_for(path) > 8
