"""Small pictures of photos for a filmstrip: JPEG decoders skip most of the work where little is wanted."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, require_file
from iibr_core.formats.images.header import read_photo_header
from iibr_core.formats.images.side_by_side import own_picture
from iibr_core.runtime.tiling import ShouldStop, never
from iibr_core.types import ImageSize, InputError

JPEG_START = b"\xff\xd8"


def read_thumbnail(path: Path, within: ImageSize, should_stop: ShouldStop = never) -> NDArray[np.uint8]:
    """The photo, upright, as large as fits within (height, width): (h, w, 3), sRGB bytes; a JPEG's colours are not
    exact.

    Raises InputError where it is no photo, or claims more pixels than any file may; Cancelled once should_stop is true.
    """
    pixels = _jpeg_thumbnail(path, within) if own_picture(path).part is None else None
    return _any_thumbnail(path, within, should_stop) if pixels is None else pixels


def _jpeg_thumbnail(path: Path, within: ImageSize) -> NDArray[np.uint8] | None:
    """By the decoder's own reduction to an eighth or so; None where this is no JPEG that Pillow takes.

    Raises InputError where there is no file.
    """
    from PIL import Image, ImageOps

    require_file(path)
    try:
        with path.open("rb") as file:
            if file.read(2) != JPEG_START:
                return None
        with warnings.catch_warnings(), Image.open(path) as image:
            warnings.simplefilter("ignore")
            if image.width * image.height > MAX_FILE_PIXELS:
                return None
            longest = max(within)
            image.draft("RGB", (longest, longest))
            upright = ImageOps.exif_transpose(image).convert("RGB")
            upright.thumbnail((within.width, within.height), Image.Resampling.BOX)
            return np.asarray(upright)
    except (OSError, ValueError, SyntaxError, TypeError, Image.DecompressionBombError):
        return None


def _any_thumbnail(path: Path, within: ImageSize, should_stop: ShouldStop) -> NDArray[np.uint8]:
    from iibr_core.formats.images.photo import read_picture

    size = read_photo_header(path).size
    if math.prod(size) > MAX_FILE_PIXELS:
        raise InputError(f"{path}: {size} is more than any photo has")
    smaller = min(within.height / size.height, within.width / size.width, 1.0)
    max_pixels = max(math.floor(math.prod(size) * smaller**2), 1)
    pixels = read_picture(own_picture(path), max_pixels, should_stop=should_stop).pixels
    # One that was turned may still be too large, as may a very narrow one.
    step = max(math.ceil(pixels.shape[0] / within.height), math.ceil(pixels.shape[1] / within.width), 1)
    return np.round(np.nan_to_num(pixels[::step, ::step]).clip(0.0, 1.0) * 255).astype(np.uint8)
