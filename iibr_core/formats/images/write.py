"""Writes pictures, whole or not at all: those that people keep (`write_picture`), and views and data (`write_image`).

The writers and their libraries are imported on use: the window asks for the kinds of files before anything is loaded.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE, bytes_from_encoded, linear_from_srgb, srgb_from_linear
from iibr_core.formats.files import reason_of
from iibr_core.formats.outputs import write_file
from iibr_core.types import DISPLAY_P3, SRGB, ColorSpace, ImageSize, InputError, image_size

if TYPE_CHECKING:
    from iibr_core.formats.images.metadata import PictureMetadata

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
        """Return the bits of a channel for a file. Raises InputError where its kind is unknown or lacks them."""
        kind = picture_kind(path)
        bits = kind.bits[0] if self.bits is None else self.bits
        if bits not in kind.bits:
            known = " or ".join(map(str, sorted(kind.bits)))
            more = " (.png and .tif hold 16)" if bits == 16 else ""
            raise InputError(f"{path}: {kind.name} is written with {known} bits a channel, not {bits}{more}")
        return bits


AS_USUAL = PictureFormat()


def picture_kind(path: Path) -> PictureKind:
    """Return the kind of a file by its ending. Raises InputError for unknown ones."""
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


def write_picture(
    path: Path,
    pixels: NDArray[Any],
    form: PictureFormat = AS_USUAL,
    metadata: PictureMetadata | None = None,
    color_space: ColorSpace = SRGB,
) -> None:
    """Write a picture that people keep, with its colour profile.

    pixels: (H, W, 3) of `color_space`, uint8 encoded by sRGB's curve, or float32 linear light, 1 = white. metadata: of
    the photo that it was made of; the module `metadata` states which parts are kept.
    """
    from iibr_core.formats.images.picture_writers import write_content

    path = Path(path)
    require_picture_format(path, form, image_size(pixels))
    kind = picture_kind(path)
    stored = _stored(pixels, form.bits_for(path), kind.is_linear)
    with write_file(path) as temporary, _errors_naming(path):
        write_content(temporary, kind.name, stored, form, metadata, color_space)


def write_image(path: Path, pixels: NDArray[Any], metadata: Mapping[str, str | int | float] | None = None) -> None:
    """Write views and data: sRGB-encoded pixels (H, W) or (H, W, C), uint8, or floats with 1 = white.

    `.png` gets 8 bits, `.exr` linear light: half floats for uint8 and float16, else float32.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".png", ".exr"):
        raise InputError(f"{path}: can be written as .png or .exr only")
    stored = np.atleast_3d(pixels)
    if kind == ".png":
        stored, dtype = stored if stored.dtype == np.uint8 else bytes_from_encoded(np.nan_to_num(stored)), "uint8"
    else:
        dtype = "half" if stored.dtype in (np.uint8, np.float16) else "float"
        stored = linear_from_srgb(stored / np.float32(255) if stored.dtype == np.uint8 else stored)
        stored = np.minimum(stored, np.finfo(np.float16).max).astype(np.float16) if dtype == "half" else stored
    write_image_file(path, np.ascontiguousarray(stored), dtype, {**PNG_SETTINGS, **(metadata or {})})


def write_image_file(
    path: Path,
    values: NDArray[Any],
    dtype: str,
    attributes: Mapping[str, str | int | float] | None = None,
    channels: tuple[str, ...] = (),
) -> None:
    """Write values (H, W, C) by OpenImageIO, stored as `dtype` in its words ("uint8", "half", "float").

    attributes: of the file's header. channels: names of the channels, where they are not those of grey, RGB or RGBA.
    """
    from iibr_core.formats.images.picture_writers import write_by_oiio

    with write_file(path) as temporary, _errors_naming(path):
        write_by_oiio(temporary, values, dtype, attributes or {}, channels)


@contextmanager
def _errors_naming(path: Path) -> Iterator[None]:
    """Raise InputError that names `path` for errors of writers, which know a temporary name only."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    except (ValueError, RuntimeError, struct.error, MemoryError) as error:
        raise InputError(f"{path}: cannot be written ({reason_of(error)}); choose another kind of file") from error


def _stored(pixels: NDArray[Any], bits: int, is_linear: bool) -> NDArray[Any]:
    """Return pixels as numbers of the file; a few rows at a time, as steps between take more memory."""
    if pixels.dtype == np.uint8 and bits == 8:
        return np.ascontiguousarray(pixels)
    kinds: dict[tuple[int, bool], type] = {(16, True): np.float16, (32, True): np.float32, (16, False): np.uint16}
    result: NDArray[Any] = np.empty(pixels.shape, kinds.get((bits, is_linear), np.uint8))
    for first in range(0, len(pixels), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        result[rows] = (_light_of if is_linear else _codes_of)(pixels[rows], result.dtype)
    return result


def _light_of(pixels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    light = linear_from_srgb(pixels / np.float32(255)) if pixels.dtype == np.uint8 else np.nan_to_num(pixels)
    most = float(np.finfo(dtype).max)
    return np.asarray(np.clip(light, -most, most))


def _codes_of(pixels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    if pixels.dtype == np.uint8:
        return pixels.astype(np.uint16) * np.uint16(257)
    encoded = srgb_from_linear(np.clip(np.nan_to_num(pixels), 0, 1))
    return bytes_from_encoded(encoded) if dtype == np.uint8 else np.asarray(encoded * 65535 + 0.5)
