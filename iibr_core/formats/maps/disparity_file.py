"""Disparity from a file, in pixels per view step at the photo's size.

A name ending in `_depth` holds depth (larger = farther, any unit); every other map is disparity (larger = closer).
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.formats.maps.reader import read_map
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.inpainting.disparity_holes import fill_disparity_holes, say_filled
from iibr_core.types import Disparity, FloatImage, ImageSize, InputError, image_size

DoubleImage = NDArray[np.float64]  # scaling must not overflow before the limit is looked at

MAX_ASPECT_DIFFERENCE = 0.03
MAX_DISPARITY_WIDTHS = 4.0
"""Disparities beyond this many photo widths per view step count as unknown."""
DEPTH_SPAN_WIDTHS = 0.01
"""Depth has no baseline; its disparity is given this span from the far to the near end, in photo widths per step."""
FLAT_DEPTH_SHARE = 1e-4
MOSTLY_UNKNOWN = 0.9
"""A map of which more is unknown is filled before it is resampled."""


def read_disparity(path: Path, size: ImageSize, scale: float = 1.0, photo: FloatImage | None = None) -> Disparity:
    """Read a PFM, EXR, NPY or PNG map for a photo of (height, width); `scale` multiplies its values.

    Unknown values (NaN, infinite, 0 in 8- and 16-bit pictures, alpha 0, absurdly large) are filled by what looks like
    them in the photo (height, width, 3), sRGB-encoded, or from their background side where that is not given. A map of
    another size is resampled surface by surface, its values scaled by the ratio of widths.
    Raises InputError if the file is bad, has another aspect ratio than the photo, or knows no value at all.
    """
    path = Path(path)
    if not math.isfinite(scale) or scale == 0:
        raise InputError(f"--disparity-scale {scale}: must be a number other than 0")
    stored = read_map(path)
    _require_aspect(path, image_size(stored), size)
    is_depth = path.stem.endswith("_depth")
    scaled: FloatImage | DoubleImage
    if is_depth:
        scaled, notes = _disparity_from_depth(stored, size.width, scale), _depth_notes(path)
    else:
        scaled, notes = stored, ()
    factor = 1.0 if is_depth else scale * size.width / stored.shape[1]
    values, limit_notes = _without_absurd(path, scaled, factor, MAX_DISPARITY_WIDTHS * size.width)
    unknown = np.isnan(values).mean()
    if unknown > MOSTLY_UNKNOWN:
        # Scattered values would get lost among what is unknown.
        values = _fill_unknown(path, values, None)
    if values.shape != size:
        notes += (f"{path.name} was resampled from {stored.shape[1]}x{stored.shape[0]} to {size}.",)
        values = resample_surfaces(values, size)
        unknown = max(unknown, np.isnan(values).mean())
    if unknown > 0:
        notes += (say_filled(path.name, float(unknown)),)
    holes = np.isnan(values)
    filled = _fill_unknown(path, values, photo)
    return Disparity(filled, path.name, notes + limit_notes, unknown=holes if holes.any() else None)


def _require_aspect(path: Path, map_size: ImageSize, size: ImageSize) -> None:
    (map_height, map_width), (height, width) = map_size, size
    if map_size != size and abs(map_width * height / (map_height * width) - 1) > MAX_ASPECT_DIFFERENCE:
        raise InputError(
            f"{path}: {map_width}x{map_height} differs in shape from the photo, {width}x{height}; "
            "crop or rotate it to match"
        )


def _disparity_from_depth(depth: FloatImage, width: int, scale: float) -> DoubleImage:
    """Disparity that is 0 at the far end of the depths (99 of 100 are nearer) and spans DEPTH_SPAN_WIDTHS to the near
    end.

    Depths that are not finite and positive are NaN in the result; so is everything if all are.
    """
    inverse = np.full(depth.shape, np.nan)
    known = np.isfinite(depth) & (depth > 0)
    inverse[known] = 1 / depth[known].astype(np.float64)
    if not known.any():
        return inverse
    far, near = np.percentile(inverse[known], [1, 99])
    span = near - far
    factor = DEPTH_SPAN_WIDTHS * width * scale / span if span > FLAT_DEPTH_SHARE * near else 0.0
    return np.asarray((inverse - far) * factor)


def _depth_notes(path: Path) -> tuple[str, ...]:
    span = f"{100 * DEPTH_SPAN_WIDTHS:g} % of the width"
    return (f"{path.name} holds depth of unknown baseline: near and far were set {span} apart per view step.",)


def _without_absurd(
    path: Path, values: FloatImage | DoubleImage, factor: float, limit_px: float
) -> tuple[FloatImage, tuple[str, ...]]:
    """Values times a factor as float32, those that are then infinite or beyond the limit as NaN.

    Raises InputError if nothing is left.
    """
    known = values if values.dtype == np.float32 else np.empty(values.shape, np.float32)
    count = 0
    # Some rows at a time, in place: as doubles a large map would take twice its own memory more.
    for first in range(0, len(values), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        scaled = values[rows].astype(np.float64) * factor
        absurd = np.abs(scaled) > limit_px
        count += int((absurd & np.isfinite(scaled)).sum())
        known[rows] = np.where(absurd, np.nan, scaled).astype(np.float32)
    if np.isnan(known).all() and count:
        raise InputError(f"{path}: every value exceeds {limit_px:g} px per view step; give a smaller --disparity-scale")
    if np.isnan(known).all():
        raise InputError(f"{path}: no value is known (all are NaN, infinite, 0 or masked); give another map")
    notes = (f"{count} values of {path.name} beyond {limit_px:g} px per view step count as unknown.",) if count else ()
    return np.asarray(known, np.float32), notes


def _fill_unknown(path: Path, values: FloatImage, photo: FloatImage | None) -> FloatImage:
    try:
        return fill_disparity_holes(values) if photo is None else fill_disparity_by_color(photo, values)
    except ValueError as error:
        raise InputError(f"{path}: too few known values survive at the photo's size; give a denser map") from error
