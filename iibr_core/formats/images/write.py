"""Writes pictures, whole or not at all: those that people keep (`write_picture`), and views and data (`write_image`).

The libraries of pictures are imported on use: the window imports this module before it opens.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE, bytes_from_encoded, linear_from_srgb, srgb_from_linear
from iibr_core.formats.files import reason_of
from iibr_core.formats.images.picture_kinds import (
    AS_USUAL,
    PNG_SETTINGS,
    PictureFormat,
    picture_kind,
    require_picture_format,
)
from iibr_core.formats.outputs import write_file
from iibr_core.remedies import FixableError, remedy_of
from iibr_core.types import SRGB, ColorSpace, InputError, image_size

if TYPE_CHECKING:
    from iibr_core.formats.images.metadata import PictureMetadata


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
        raise FixableError(f"{path}: {error}", remedy_of(error)) from error
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
