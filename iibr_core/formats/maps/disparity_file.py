"""Disparity from a file, in pixels per view step: larger is nearer."""

import math
from pathlib import Path

import numpy as np

from iibr_core.formats.maps.map_names import says_depth
from iibr_core.formats.maps.reader import read_map
from iibr_core.formats.maps.resample import resample_map
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.inpainting.disparity_holes import fill_disparity_holes, say_filled
from iibr_core.types import MAX_DISPARITY_WIDTHS, Disparity, FloatImage, ImageSize, InputError, image_size

MAX_ASPECT_DIFFERENCE = 0.03
MOSTLY_UNKNOWN = 0.9
"""Share of unknown values from which a map is filled before it is resampled: its values would get lost."""


def read_disparity(path: Path, size: ImageSize, scale: float = 1.0, photo: FloatImage | None = None) -> Disparity:
    """Read a map of disparity for a view of (height, width); `scale` multiplies its values.

    Unknown values (NaN, infinite, 0 in files of integers, transparent, absurdly large) are filled from similar colours
    of the view `photo` (height, width, 3), sRGB-encoded, or from their background side without it. A map of another
    size is resampled, its values scaled by the ratio of widths. Another aspect ratio and empty maps are refused.
    """
    path = Path(path)
    if says_depth(path.stem):
        raise InputError(f"{path}: holds depth, by its name; views of a light field take disparity, px per view step")
    stored = read_map(path)
    if not has_shape_of(image_size(stored), size):
        raise InputError(
            f"{path}: {image_size(stored)} differs in shape from the view, {size}; crop or rotate it to match"
        )
    values, notes = scaled_disparity(path, stored, require_scale(scale))
    notes += resampling_note(path.name, values, size) + filling_note(path.name, values)
    values = map_at_size(values, size) * np.float32(size.width / stored.shape[1])
    holes = np.isnan(values)
    if holes.any():
        try:
            values = fill_disparity_holes(values) if photo is None else fill_disparity_by_color(photo, values)
        except ValueError as error:
            raise InputError(f"{path}: too few known values survive at the view's size; give a denser map") from error
    return Disparity(values, path.name, notes, unknown=holes if holes.any() else None)


def has_shape_of(first: ImageSize, second: ImageSize) -> bool:
    """Return whether two (height, width) have nearly the same aspect ratio."""
    ratio = first.width * second.height / (first.height * second.width)
    return first == second or abs(ratio - 1) <= MAX_ASPECT_DIFFERENCE


def require_scale(scale: float | None) -> float:
    """Return the scale, 1 for None."""
    if scale is not None and (not math.isfinite(scale) or scale == 0):
        raise InputError(f"disparity scale {scale}: must be a number other than 0")
    return 1.0 if scale is None else scale


def scaled_disparity(path: Path, values: FloatImage, scale: float) -> tuple[FloatImage, tuple[str, ...]]:
    """Return values (H, W) times the scale, NaN where that is unknown or absurdly large, and a note of these.

    Raises InputError if nothing is left.
    """
    limit_px = MAX_DISPARITY_WIDTHS * values.shape[1]
    scaled = values.astype(np.float64) * scale
    is_absurd = np.abs(scaled) > limit_px
    count = int((is_absurd & np.isfinite(scaled)).sum())
    known = np.where(is_absurd, np.nan, scaled).astype(np.float32)
    if np.isnan(known).all() and count:
        raise InputError(f"{path}: every value exceeds {limit_px:g} px per view step; give a smaller disparity scale")
    if np.isnan(known).all():
        raise InputError(f"{path}: no value is known (all are NaN, infinite, 0 or masked); give another map")
    note = f"{count} values of {path.name} beyond {limit_px:g} px per view step count as unknown."
    return known, (note,) if count else ()


def map_at_size(values: FloatImage, size: ImageSize) -> FloatImage:
    """Return a map (h, w) at another (height, width), its values unchanged, NaN where little is known."""
    if values.shape == size:
        return values
    if MOSTLY_UNKNOWN < np.isnan(values).mean() < 1:
        values = fill_disparity_holes(values)
    return resample_map(values, size)


def filling_note(name: str, values: FloatImage) -> tuple[str, ...]:
    """Return a sentence on a map with unknown values; none where all are known."""
    unknown = float(np.isnan(values).mean())
    return (say_filled(name, unknown),) if unknown else ()


def resampling_note(name: str, values: FloatImage, size: ImageSize) -> tuple[str, ...]:
    """Return a sentence on a map (h, w) that becomes another (height, width); none where the sizes agree."""
    stored = image_size(values)
    return () if stored == size else (f"{name} was resampled from {stored} to {size}.",)
