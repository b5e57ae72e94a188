"""Small copies of pictures: for thumbnails, and for decisions about content before a picture is read."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.color import bytes_from_encoded
from iibr_core.formats.images.decode import decode, read_orientation
from iibr_core.formats.images.picture import full_scale, upright
from iibr_core.formats.images.pillow_reader import DECODE_ERRORS
from iibr_core.types import ImageSize

DEEP_MODES = ("I", "F")
"""Modes of Pillow whose values it does not bring to 8 bits."""


def small_picture(path: Path, within: ImageSize, is_smoothed: bool = False) -> NDArray[np.uint8] | None:
    """Return a picture's colours as stored, (h, w, 3), upright, within a size; None for files that Pillow cannot read.

    is_smoothed: each pixel is the mean of those it covers, else one of them.
    """
    with suppress(*DECODE_ERRORS, TypeError), Image.open(path) as picture:
        picture.draft("RGB", (2 * max(within), 2 * max(within)))
        if picture.mode.startswith(DEEP_MODES):
            return None
        orientation = read_orientation(path)
        box = ImageSize(within.width, within.height) if orientation >= 5 else within
        # Palettes cannot be averaged.
        whole = picture.convert("RGB") if is_smoothed and picture.mode != "RGB" else picture
        return upright(np.asarray(_resize(whole, box, is_smoothed).convert("RGB")), orientation)
    return None


def small_decoded_picture(path: Path, longest_px: int) -> NDArray[np.uint8]:
    """Return the same, smoothed, of any picture that can be read, which may take as long as that."""
    within = ImageSize(longest_px, longest_px)
    if (small := small_picture(path, within, is_smoothed=True)) is not None:
        return small
    whole = decode(path)
    step = max(max(whole.size) // (4 * longest_px), 1)
    colors = whole.pixels[::step, ::step].astype(np.float32) / np.float32(full_scale(whole.pixels.dtype))
    encoded = bytes_from_encoded(np.nan_to_num(colors))
    picture = Image.fromarray(np.broadcast_to(encoded, (*encoded.shape[:2], 3)).copy())
    return upright(np.asarray(_resize(picture, within, is_smoothed=True)), whole.orientation)


def _resize(picture: Image.Image, within: ImageSize, is_smoothed: bool) -> Image.Image:
    ratio = max(picture.height / within.height, picture.width / within.width, 1.0)
    width, height = (max(round(side / ratio), 2) for side in picture.size)
    return picture.resize((width, height), Image.Resampling.BOX if is_smoothed else Image.Resampling.NEAREST)
