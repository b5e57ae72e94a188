"""Photos in, pictures out. Integer files are sRGB-encoded as they are; floating-point files hold linear light.

Everything that changes the photo on the way in (alpha, size, odd values, colour profile) is said in its notes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, linear_from_srgb, srgb_from_linear
from iibr_core.formats.files import require_file
from iibr_core.formats.images.heic import is_heic, read_heic
from iibr_core.formats.images.oiio_reader import Raster, read_raster, text_attribute
from iibr_core.formats.images.oiio_writer import write_image_file
from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage, ImageSize, InputError, Photo, image_size

DEFAULT_MAX_PIXELS = 2_000_000
DEFAULT_FOV_DEG = 50.0
FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)  # "35 mm equivalent" compares diagonals (CIPA DCG-001)
MM_PER_RESOLUTION_UNIT = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}  # Exif 2.3, FocalPlaneResolutionUnit
# Compression level 1 is 8 times faster than the default 6, 10 % larger; filter 64 is the average.
PNG_SETTINGS: Mapping[str, str | int | float] = {"png:compressionLevel": 1, "png:filter": 64}
BAND_ROWS = 32


def read_photo(path: Path, max_pixels: int = DEFAULT_MAX_PIXELS, fov_deg: float = DEFAULT_FOV_DEG) -> Photo:
    """Read a JPEG, PNG, TIFF, EXR, HDR, WebP (whatever OpenImageIO reads) or HEIC as a photo, upright, max_pixels
    large at most.

    fov_deg: horizontal field of view where the file gives no focal length. Raises InputError, naming the file, if it
    is missing, no picture, cut off, or absurdly large.
    """
    path = Path(path)
    if max_pixels < 1:
        raise InputError(f"--max-pixels {max_pixels}: must be 1 or more")
    require_file(path)
    raster = read_heic(path) if is_heic(path) else read_raster(path)
    notes = _color_notes(raster.spec) + _alpha_notes(raster)
    raster, finite_notes = _finite(raster)
    stored_size = image_size(raster.pixels)
    size = size_within(stored_size, max_pixels)
    if size == stored_size:
        encoded = _encode(raster)
    else:
        encoded = srgb_from_linear(_downsampled_linear(raster, size))
        said = f"{stored_size} to {size}"
        notes += (f"Made smaller by area averaging, from {said} (--max-pixels {max_pixels}).",)
    pixels = upright(encoded, raster.spec.get_int_attribute("Orientation", 1))
    focal_px = _exif_focal_px(raster.spec)
    if focal_px is None:
        focal_px = focal_px_from_fov(pixels.shape[1], fov_deg)
    else:
        focal_px *= math.sqrt(size.height * size.width / (stored_size.height * stored_size.width))
    return Photo(pixels, focal_px, path.stem, bool(pixels.max() > 1), notes + finite_notes)


def write_image(path: Path, pixels: NDArray[Any], metadata: Mapping[str, str | int | float] | None = None) -> None:
    """Write sRGB-encoded pixels, (H, W) or (H, W, C): uint8 as it is, floats with 1 = white. Whole or not at all.

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


def upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Turn stored (H, W, ...) pixels as Exif's Orientation 1..8 says; other values leave them alone."""
    if orientation >= 5 and orientation <= 8:
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def _encode(raster: Raster) -> FloatImage:
    """sRGB-encoded (H, W, 3) at the stored size. Opaque integer files pass untouched: they are encoded already."""
    if raster.pixels.dtype.kind == "u" and raster.alpha is None:
        encoded = raster.pixels.astype(np.float32) * np.float32(1 / np.iinfo(raster.pixels.dtype).max)
        return np.ascontiguousarray(np.broadcast_to(encoded, (*encoded.shape[:2], 3)))
    return srgb_from_linear(_linear(raster, slice(None)))


def _linear(raster: Raster, rows: slice) -> FloatImage:
    """Linear light over black, (rows, W, 3), of some rows of a raster."""
    pixels = raster.pixels[rows]
    if pixels.dtype.kind == "u":
        steps = np.iinfo(pixels.dtype).max
        linear = linear_from_srgb(np.arange(steps + 1, dtype=np.float32) / steps)[pixels]
    else:
        linear = np.maximum(pixels, 0)
    if raster.alpha is not None and raster.spec.get_int_attribute("oiio:UnassociatedAlpha"):
        full = np.iinfo(raster.alpha.dtype).max if raster.alpha.dtype.kind == "u" else 1
        alpha = np.nan_to_num(raster.alpha[rows].astype(np.float32) / full)
        linear = linear * np.clip(alpha, 0, 1)[..., None]
    return np.ascontiguousarray(np.broadcast_to(linear, (*linear.shape[:2], 3)), np.float32)


def _downsampled_linear(raster: Raster, size: ImageSize) -> FloatImage:
    """Area averages of linear light, in bands of rows so that a huge file never exists as floats."""
    stored_height = raster.pixels.shape[0]
    result = np.empty((*size, 3), np.float32)
    for top in range(0, size.height, BAND_ROWS):
        bottom = min(top + BAND_ROWS, size.height)
        first = top * stored_height // size.height
        last = min(stored_height, -(-bottom * stored_height // size.height))
        _average_areas(_linear(raster, slice(first, last)), first, stored_height / size.height, top, result[top:bottom])
    return result


@kernel
def _average_areas(band, band_top, row_step, result_top, result):
    """Average band (rows, W, 3) over the area of each pixel of result (rows, w, 3).

    Pixel i of the result covers rows i * row_step .. (i + 1) * row_step of the whole source; band_top and result_top
    are the first rows of the two in their wholes.
    """
    column_step = band.shape[1] / result.shape[1]
    for y in range(result.shape[0]):
        # Exact area averages: border rows and columns count by the share that lies inside.
        y0 = (result_top + y) * row_step - band_top
        y1 = min(y0 + row_step, float(band.shape[0]))
        for x in range(result.shape[1]):
            x0 = x * column_step
            x1 = min(x0 + column_step, float(band.shape[1]))
            red, green, blue, area = 0.0, 0.0, 0.0, 0.0
            for row in range(max(int(y0), 0), min(math.ceil(y1), band.shape[0])):
                covered_rows = min(y1, row + 1.0) - max(y0, float(row))
                for column in range(int(x0), min(math.ceil(x1), band.shape[1])):
                    weight = covered_rows * (min(x1, column + 1.0) - max(x0, float(column)))
                    red += weight * band[row, column, 0]
                    green += weight * band[row, column, 1]
                    blue += weight * band[row, column, 2]
                    area += weight
            result[y, x, 0] = red / area
            result[y, x, 1] = green / area
            result[y, x, 2] = blue / area


def _finite(raster: Raster) -> tuple[Raster, tuple[str, ...]]:
    """Replace NaN by 0 and infinity by the largest finite value of the picture."""
    pixels = raster.pixels
    if pixels.dtype.kind == "u" or np.isfinite(pixels).all():
        return raster, ()
    finite = np.isfinite(pixels)
    largest = float(pixels[finite].max()) if finite.any() else 1.0
    cleaned = np.nan_to_num(pixels, nan=0.0, posinf=max(largest, 0.0), neginf=0.0)
    count = int((~finite).any(axis=2).sum())
    note = f"{count} pixels held NaN or infinity: NaN became black, infinity the largest value there is ({largest:g})."
    return Raster(cleaned, raster.alpha, raster.spec), (note,)


def _alpha_notes(raster: Raster) -> tuple[str, ...]:
    return () if raster.alpha is None else ("Transparency was dropped: the photo is laid over black.",)


def _color_notes(spec: Any) -> tuple[str, ...]:
    notes: tuple[str, ...] = ()
    stored_as = text_attribute(spec, "jpeg:ColorSpace") or text_attribute(spec, "tiff:ColorSpace")
    if "CMYK" in stored_as or "YCCK" in stored_as:
        notes += ("CMYK was converted to RGB without its colour profile.",)
    elif spec.getattribute("ICCProfile") is not None:
        profile = text_attribute(spec, "ICCProfile:profile_description") or "without a name"
        if "sRGB" not in profile:
            notes += (f"The colour profile '{profile}' is ignored: colours are taken as sRGB.",)
    return notes


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
