"""Photos in, pictures out. Integer files are encoded as they state; floating-point files hold linear light.

Everything that changes the photo on the way in (alpha, size, odd values, colour profile, HDR) is said in its notes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE, bytes_from_encoded, convert, linear_from_srgb, srgb_from_linear
from iibr_core.formats.files import require_file, shown_name
from iibr_core.formats.images.color_profile import color_profile_of, color_space_of
from iibr_core.formats.images.downsampling import OddValues, downsampled_linear, finite_pixels, linear_light
from iibr_core.formats.images.file_notes import file_notes
from iibr_core.formats.images.hdr import tone_map
from iibr_core.formats.images.oiio_reader import PictureRows, Raster, text_attribute, upright
from iibr_core.formats.images.oiio_writer import PNG_SETTINGS, write_image_file
from iibr_core.formats.images.picture_source import PictureSource, is_read_whole, read_source
from iibr_core.formats.images.side_by_side import own_picture
from iibr_core.runtime.tiling import ShouldStop, never
from iibr_core.types import SRGB, FloatImage, ImageSize, InputError, Photo

DEFAULT_MAX_PIXELS = 2_000_000
DEFAULT_FOV_DEG = 50.0
MADE_SMALLER = "Made smaller by area averaging"
FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)  # "35 mm equivalent" compares diagonals (CIPA DCG-001)
MM_PER_RESOLUTION_UNIT = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}  # Exif 2.3, FocalPlaneResolutionUnit


def read_photo(
    path: Path,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    fov_deg: float = DEFAULT_FOV_DEG,
    keeps_primaries: bool = False,
    should_stop: ShouldStop = never,
) -> Photo:
    """Read a JPEG, PNG, TIFF, EXR, HDR, WebP, JPEG XL (whatever OpenImageIO reads), HEIC or AVIF as a photo, upright,
    max_pixels large at most: of a stereo pair the left eye's picture, of an animation the first.

    fov_deg: horizontal field of view where the file gives no focal length. keeps_primaries: the photo stays in the
    colour space of its file, else it is converted to sRGB, which cuts off what that lacks. Raises InputError, naming
    the file, if it is missing, no picture, cut off, or absurdly large; Cancelled once should_stop is true.
    """
    photo = read_picture(own_picture(Path(path)), max_pixels, fov_deg, keeps_primaries, should_stop)
    return replace(photo, notes=photo.notes + file_notes(Path(path)))


def read_picture(
    source: PictureSource,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    fov_deg: float = DEFAULT_FOV_DEG,
    keeps_primaries: bool = False,
    should_stop: ShouldStop = never,
) -> Photo:
    """Read any picture of a file, as `read_photo` does."""
    if max_pixels < 1:
        raise InputError(f"--max-pixels {max_pixels}: must be 1 or more")
    require_file(source.path)
    rows = _open_rows(source)
    stored_size, spec = rows.size, rows.spec
    size = size_within(stored_size, max_pixels)
    if size == stored_size:
        encoded, is_opaque, odd = _encode(rows.read(0, size.height))
    else:
        averaged = downsampled_linear(lambda: rows if rows.is_at_start else _open_rows(source), size, should_stop)
        linear, is_opaque, odd = averaged
        encoded = _encode_light(linear, spec)
    space = color_space_of(spec)
    if not keeps_primaries:
        encoded, space = convert(encoded, SRGB, space), SRGB
    notes = _color_notes(spec) + _alpha_notes(is_opaque)
    if size != stored_size:
        said = f"{stored_size} to {size}"
        notes += (f"{MADE_SMALLER}, from {said} (--max-pixels {max_pixels}).",)
    pixels = upright(encoded, spec.get_int_attribute("Orientation", 1))
    focal_px = _exif_focal_px(spec)
    if focal_px is None:
        focal_px = focal_px_from_fov(pixels.shape[1], fov_deg)
    else:
        focal_px *= math.sqrt(size.height * size.width / (stored_size.height * stored_size.width))
    name = shown_name(source.path.stem)
    return Photo(pixels, focal_px, name, bool(pixels.max() > 1), notes + _odd_notes(odd), space)


def encoded_colors(raster: Raster) -> FloatImage:
    """A decoded picture as a view's colours, upright: (H, W, 3), sRGB-encoded, of sRGB."""
    encoded = convert(_encode(raster)[0], SRGB, color_space_of(raster.spec))
    return upright(encoded, raster.spec.get_int_attribute("Orientation", 1))


def write_image(path: Path, pixels: NDArray[Any], metadata: Mapping[str, str | int | float] | None = None) -> None:
    """Write sRGB-encoded pixels, (H, W) or (H, W, C): uint8 as it is, floats with 1 = white. Whole or not at all. For
    views and data; pictures that people keep are written by `picture_writers`.

    `.png` gets 8 bits, `.exr` linear light: half floats for uint8 and float16, else float32. Raises InputError for
    other extensions and where the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".png", ".exr"):
        raise InputError(f"{path}: can be written as .png or .exr only")
    stored, dtype = _png_values(pixels) if kind == ".png" else _exr_values(pixels)
    write_image_file(path, stored, dtype, {**PNG_SETTINGS, **(metadata or {})})


def focal_px_from_fov(width: int, fov_deg: float = DEFAULT_FOV_DEG) -> float:
    """Focal length in pixels of a picture `width` pixels wide that shows `fov_deg` degrees horizontally."""
    return width / 2 / math.tan(math.radians(fov_deg) / 2)


def size_within(size: ImageSize, max_pixels: int) -> ImageSize:
    """The (height, width) of the same shape that holds at most max_pixels; `size` itself where that is small enough."""
    height, width = size
    if height * width <= max_pixels:
        return size
    factor = math.sqrt(max_pixels / (height * width))
    new_height = min(max(1, math.floor(height * factor)), max_pixels)
    return ImageSize(new_height, min(max(1, math.floor(width * factor)), max_pixels // new_height))


def _open_rows(source: PictureSource) -> PictureRows | Raster:
    path = source.path
    is_read_by_rows = source == PictureSource(path) and not is_read_whole(path)
    return PictureRows(path) if is_read_by_rows else read_source(source)


def _encode(raster: Raster) -> tuple[FloatImage, bool, OddValues]:
    """sRGB-encoded (H, W, 3) at the stored size, whether it is opaque, and what of it was not finite.

    Opaque integer files without a profile pass untouched: they are encoded already.
    """
    profile = color_profile_of(raster.spec)[0]
    if raster.pixels.dtype.kind == "u" and raster.alpha is None and not (profile and profile.hdr):
        if profile is not None and raster.pixels.shape[2] == 3:
            return profile.encoded(raster.pixels), True, OddValues(0, 0.0)
        encoded = raster.pixels.astype(np.float32) * np.float32(1 / np.iinfo(raster.pixels.dtype).max)
        # Writable, as all other photos are: kernels are compiled once more for arrays that are not.
        whole = np.repeat(encoded, 3, axis=2) if encoded.shape[2] == 1 else encoded
        return np.ascontiguousarray(whole), True, OddValues(0, 0.0)
    pixels, odd = finite_pixels(raster.pixels)
    linear = linear_light(Raster(pixels, raster.alpha, raster.spec))
    return _encode_light(linear, raster.spec), raster.alpha is None, odd


def _encode_light(linear: FloatImage, spec: Any) -> FloatImage:
    """The same array, tone-mapped where the photo is HDR by its profile, then sRGB-encoded.

    A few rows at a time, as that takes some times their memory.
    """
    profile = color_profile_of(spec)[0]
    if profile is not None and profile.hdr:
        tone_map(linear)
    for first in range(0, len(linear), ROWS_AT_ONCE):
        rows = linear[first : first + ROWS_AT_ONCE]
        rows[:] = srgb_from_linear(rows)
    return linear


def _odd_notes(odd: OddValues) -> tuple[str, ...]:
    if not odd.pixels:
        return ()
    largest = odd.largest if math.isfinite(odd.largest) else 1.0
    said = f"NaN became black, infinity the largest value there is ({largest:g})"
    return (f"{odd.pixels} pixels held NaN or infinity: {said}.",)


def _alpha_notes(is_opaque: bool) -> tuple[str, ...]:
    return () if is_opaque else ("Transparency was dropped: the photo is laid over black.",)


def _color_notes(spec: Any) -> tuple[str, ...]:
    stored_as = text_attribute(spec, "jpeg:ColorSpace") or text_attribute(spec, "tiff:ColorSpace")
    if "CMYK" in stored_as or "YCCK" in stored_as:
        return ("CMYK was converted to RGB without its colour profile.",)
    if "LAB" in stored_as:
        return ("Lab was converted to RGB with a tint: save the photo as RGB for its true colours.",)
    note = color_profile_of(spec)[1]
    return (note,) if note else ()


def _exif_focal_px(spec: Any) -> float | None:
    """Focal length in pixels of the stored picture, or None where Exif does not tell or tells nonsense."""
    equivalent_mm = _number(spec, "Exif:FocalLengthIn35mmFilm")
    focal_mm = _number(spec, "Exif:FocalLength")
    resolution = _number(spec, "Exif:FocalPlaneXResolution")
    diagonal_px = math.hypot(spec.width, spec.height)
    if equivalent_mm > 0:
        focal_px = equivalent_mm / FILM_DIAGONAL_MM * diagonal_px
    else:
        unit_mm = MM_PER_RESOLUTION_UNIT.get(int(_number(spec, "Exif:FocalPlaneResolutionUnit") or 2), 25.4)
        # The resolution counts pixels of the picture as the camera took it.
        taken_width = _number(spec, "Exif:PixelXDimension") or spec.width
        focal_px = focal_mm * resolution / unit_mm * (spec.width / taken_width)
    return focal_px if 0.05 * diagonal_px < focal_px < 200 * diagonal_px else None


def _number(spec: Any, name: str) -> float:
    try:
        value = spec.getattribute(name)
    except UnicodeDecodeError:  # a text where a number belongs
        return 0.0
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else 0.0


def _png_values(pixels: NDArray[Any]) -> tuple[NDArray[Any], str]:
    stored = np.atleast_3d(pixels)
    if stored.dtype != np.uint8:
        stored = bytes_from_encoded(np.nan_to_num(stored))
    return np.ascontiguousarray(stored), "uint8"


def _exr_values(pixels: NDArray[Any]) -> tuple[NDArray[Any], str]:
    stored = np.atleast_3d(pixels)
    as_half = stored.dtype in (np.uint8, np.float16)
    linear = linear_from_srgb(stored / np.float32(255) if stored.dtype == np.uint8 else stored)
    if as_half:
        linear = np.minimum(linear, np.finfo(np.float16).max).astype(np.float16)
    return np.ascontiguousarray(linear), "half" if as_half else "float"
