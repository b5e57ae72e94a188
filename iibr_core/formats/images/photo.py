"""Reads photos: colours as their profiles state; floating-point files without one hold linear light.

The notes of a photo name all that reading changed: alpha, size, values that are not finite, colour profile, HDR.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE, convert, linear_from_srgb, srgb_from_linear
from iibr_core.formats.files import require_file
from iibr_core.formats.images.color_profile import color_profile_of, color_space_of
from iibr_core.formats.images.file_notes import file_notes, tile_note
from iibr_core.formats.images.hdr import tone_map
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture import CUT_OFF, Picture, full_scale, upright
from iibr_core.formats.images.picture_source import PictureSource, read_source, shown_size, small_picture, source_size
from iibr_core.formats.images.resized_light import average_areas
from iibr_core.formats.images.side_by_side import left_picture
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import SRGB, FloatImage, ImageSize, InputError, Photo, image_size

DEFAULT_MAX_PIXELS = 2_000_000
DEFAULT_FOV_DEG = 50.0
MAX_BAND_ROWS = 32
MAX_BAND_PIXELS = 1 << 20
"""Largest number of stored pixels that are averaged at a time: as floats they take 12 bytes each, or more."""


def read_photo(
    path: Path,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    fov_deg: float = DEFAULT_FOV_DEG,
    keeps_primaries: bool = False,
) -> Photo:
    """Read a photo of any kind, upright, with at most `max_pixels`.

    Of a stereo pair the left eye's picture is read, of an animation the first one. fov_deg: horizontal field of view
    where the file states no focal length. keeps_primaries: whether the photo stays in the colour space of its file;
    else it is converted to sRGB, which cuts off colours outside it. A JPEG that is cut off is read as far as it goes.
    Raises InputError, naming the file, if it is missing, no picture, cut off, or absurdly large.
    """
    photo = read_picture(left_picture(Path(path)), max_pixels, fov_deg, keeps_primaries)
    return replace(photo, notes=photo.notes + file_notes(Path(path)) + tile_note(photo.pixels))


def read_picture(
    source: PictureSource,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    fov_deg: float = DEFAULT_FOV_DEG,
    keeps_primaries: bool = False,
) -> Photo:
    """Read any picture of a file, as `read_photo` does."""
    if max_pixels < 1:
        raise InputError(f"limit of {max_pixels} pixels: give 1 or more")
    require_file(source.path)
    stored_size = source_size(source)
    size = size_within(stored_size, max_pixels)
    is_smaller, is_whole = size != stored_size, source == PictureSource(source.path)
    opened = open_picture(source.path)
    bands = opened.bands() if is_smaller and is_whole else iter([opened.decode() if is_whole else read_source(source)])
    picture, finite_notes = _finite(next(bands))
    is_cut_off = picture.is_cut_off
    try:
        if is_smaller:
            light, is_cut_off = _averaged(picture, bands, stored_size, size)
            encoded = _encode_light(light, picture)
        else:
            encoded = _encode(picture)
    except StopIteration as error:  # the header states another size than the picture has
        raise InputError(f"{source.path}: damaged (rows are missing); get the whole file again") from error
    space = color_space_of(picture)
    if not keeps_primaries:
        encoded, space = convert(encoded, SRGB, space), SRGB
    note = picture.note or color_profile_of(picture)[1]
    notes: tuple[str, ...] = (note,) if note else ()
    if is_cut_off:
        notes += (CUT_OFF,)
    if picture.alpha is not None:
        notes += ("Transparency was dropped: the photo is laid over black.",)
    pixels = upright(encoded, picture.orientation)
    if is_smaller:
        own_size = stored_size if image_size(pixels) == size else ImageSize(stored_size.width, stored_size.height)
        notes += (smaller_note(own_size, image_size(pixels)),)
    focal_px = focal_px_from_fov(pixels.shape[1], fov_deg)
    if picture.focal_px > 0:
        focal_px = picture.focal_px * math.sqrt(math.prod(size) / math.prod(stored_size))
    return Photo(pixels, focal_px, source.path.stem, bool(pixels.max() > 1), notes + finite_notes, space)


def smaller_note(own_size: ImageSize, size: ImageSize) -> str:
    """Return the note of a photo that was read at a smaller size than its own, both upright."""
    return f"Made smaller by area averaging, from {own_size} to {size}."


def encoded_colors(picture: Picture) -> FloatImage:
    """Return a decoded picture as a view's colours, upright: (H, W, 3), sRGB-encoded, of sRGB."""
    encoded = convert(_encode(_finite(picture)[0]), SRGB, color_space_of(picture))
    return upright(encoded, picture.orientation)


def read_thumbnail(path: Path, within: ImageSize) -> NDArray[np.uint8]:
    """Read a photo, upright, as large as fits within (height, width): (h, w, 3), sRGB bytes.

    The colours of JPEGs are not exact: their decoder skips most of the work.
    """
    source = left_picture(path)
    is_whole_jpeg = source.part is None and open_picture(path).kind == "JPEG"
    small = small_picture(path, within) if is_whole_jpeg else None
    if small is not None:
        return small
    size = shown_size(source)
    scale = min(within.height / size.height, within.width / size.width, 1.0)
    sides = (max(side * scale, 1) for side in size)  # a very narrow photo keeps its length
    colors = read_picture(source, math.floor(math.prod(sides))).pixels
    # Rounding may leave a pixel too many.
    step = max(math.ceil(colors.shape[0] / within.height), math.ceil(colors.shape[1] / within.width), 1)
    return np.round(np.nan_to_num(colors[::step, ::step]).clip(0.0, 1.0) * 255).astype(np.uint8)


def focal_px_from_fov(width: int, fov_deg: float = DEFAULT_FOV_DEG) -> float:
    """Return the focal length in pixels of a picture `width` pixels wide that shows `fov_deg` degrees horizontally."""
    return width / 2 / math.tan(math.radians(fov_deg) / 2)


def size_within(size: ImageSize, max_pixels: int) -> ImageSize:
    """Return the (height, width) of the same shape with at most `max_pixels`; `size` where it is small enough."""
    height, width = size
    if height * width <= max_pixels:
        return size
    factor = math.sqrt(max_pixels / (height * width))
    new_height = min(max(1, math.floor(height * factor)), max_pixels)
    return ImageSize(new_height, min(max(1, math.floor(width * factor)), max_pixels // new_height))


def linear_light(picture: Picture) -> FloatImage:
    """Return linear light over black, (H, W, 3), of finite pixels, in the picture's colour space.

    HDR photos exceed white, 1, as floating-point files do.
    """
    pixels, profile = picture.pixels, color_profile_of(picture)[0]
    if profile is not None:
        linear: NDArray[Any] = profile.linear(np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels)
    elif not picture.is_float:
        steps = full_scale(pixels.dtype)
        linear = linear_from_srgb(np.arange(steps + 1, dtype=np.float32) / steps)[pixels]
    else:
        linear = np.maximum(pixels, 0)
    if picture.alpha is not None and not picture.is_premultiplied:
        alpha = np.nan_to_num(picture.alpha.astype(np.float32) / full_scale(picture.alpha.dtype))
        linear = linear * np.clip(alpha, 0, 1)[..., None]
    return np.ascontiguousarray(np.repeat(linear, 3, axis=2) if linear.shape[2] == 1 else linear, np.float32)


def _finite(picture: Picture) -> tuple[Picture, tuple[str, ...]]:
    """Return a picture with NaN as black and infinity as its largest finite value, and a note where it had any."""
    pixels = picture.pixels
    if not picture.is_float:
        return picture, ()
    is_finite = np.isfinite(pixels)
    if is_finite.all():
        return picture, ()
    largest = float(pixels.max(initial=-np.inf, where=is_finite))
    largest = largest if math.isfinite(largest) else 1.0
    cleaned = np.nan_to_num(pixels, nan=0.0, posinf=max(largest, 0.0), neginf=0.0)
    count = int((~is_finite).any(axis=2).sum())
    replaced = f"NaN became black, infinity the largest value there is ({largest:g})"
    return replace(picture, pixels=cleaned), (f"{count} pixels held NaN or infinity: {replaced}.",)


def _encode(picture: Picture) -> FloatImage:
    """Return a picture of finite pixels over black, sRGB-encoded (H, W, 3), at its stored size."""
    profile = color_profile_of(picture)[0]
    if picture.is_float or picture.alpha is not None or (profile is not None and profile.hdr):
        return _encode_light(linear_light(picture), picture)
    if profile is not None:
        return profile.encoded(picture.pixels)
    # Such files are encoded already. The copy can be written to: kernels are compiled once more for other arrays.
    encoded = picture.pixels.astype(np.float32) * np.float32(1 / full_scale(picture.pixels.dtype))
    return np.repeat(encoded, 3, axis=2) if encoded.shape[2] == 1 else encoded


def _encode_light(linear: FloatImage, picture: Picture) -> FloatImage:
    """Encode linear light (H, W, 3) by sRGB's curve in place, after tone mapping where the profile is of HDR."""
    profile = color_profile_of(picture)[0]
    if profile is not None and profile.hdr:
        tone_map(linear)
    for first in range(0, len(linear), ROWS_AT_ONCE):
        rows = linear[first : first + ROWS_AT_ONCE]
        rows[:] = srgb_from_linear(rows)
    return linear


def _averaged(
    first_band: Picture, bands: Iterator[Picture], stored_size: ImageSize, size: ImageSize
) -> tuple[FloatImage, bool]:
    """Return the mean linear light (H, W, 3) of a picture at a smaller size, and whether its file is cut off.

    first_band, bands: the rows of the picture from top to bottom; few of them are floats at a time.
    """
    result, kept, kept_from = np.empty((*size, 3), np.float32), first_band, 0
    row_step = stored_size.height / size.height
    band_rows = min(max(int(MAX_BAND_PIXELS / stored_size.width / row_step), 1), MAX_BAND_ROWS)
    for top in range(0, size.height, band_rows):
        raise_if_stopped()
        bottom = min(top + band_rows, size.height)
        first, last = top * stored_size.height // size.height, -(-bottom * stored_size.height // size.height)
        while kept_from + kept.size.height < last:
            band = next(bands)
            pixels = np.concatenate([kept.pixels[max(first - kept_from, 0) :], band.pixels])
            kept, kept_from = replace(kept, pixels=pixels, is_cut_off=band.is_cut_off), max(first, kept_from)
        rows = slice(first - kept_from, last - kept_from)
        alpha = None if kept.alpha is None else kept.alpha[rows]
        light = linear_light(replace(kept, pixels=kept.pixels[rows], alpha=alpha))
        area = top * row_step - first, 0.0, (bottom - top) * row_step, float(stored_size.width)
        average_areas(light, area, 0, bottom - top, result[top:bottom])
    return result, kept.is_cut_off
