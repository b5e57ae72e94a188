"""Small copies of pictures, for decisions about their content before they are read."""

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

DEEP_MODES = ("I", "F")
"""Modes of Pillow whose values it does not bring to 8 bits."""


def small_picture(path: Path, longest_px: int, is_smoothed: bool = False) -> NDArray[np.uint8] | None:
    """Return a picture's colours as stored, (h, w, 3), upright, `longest_px` at most; None where Pillow does not.

    is_smoothed: each pixel is the mean of those it covers, else one of them.
    """
    with suppress(*DECODE_ERRORS), Image.open(path) as picture:
        picture.draft("RGB", (2 * longest_px, 2 * longest_px))
        if picture.mode.startswith(DEEP_MODES):
            return None
        # Palettes cannot be averaged.
        whole = picture.convert("RGB") if is_smoothed and picture.mode != "RGB" else picture
        small = _resize(whole, longest_px, is_smoothed).convert("RGB")
        return upright(np.asarray(small), read_orientation(path))
    return None


def small_decoded_picture(path: Path, longest_px: int) -> NDArray[np.uint8]:
    """Return the same, smoothed, of any picture that can be read, which may take as long as that.

    Raises InputError as `decode` does.
    """
    if (found := small_picture(path, longest_px, is_smoothed=True)) is not None:
        return found
    whole = decode(path)
    step = max(max(whole.size) // (4 * longest_px), 1)
    colors = whole.pixels[::step, ::step].astype(np.float32) / np.float32(full_scale(whole.pixels.dtype))
    encoded = bytes_from_encoded(np.nan_to_num(colors))
    picture = Image.fromarray(np.broadcast_to(encoded, (*encoded.shape[:2], 3)).copy())
    small = np.asarray(_resize(picture, longest_px, is_smoothed=True))
    return upright(small, whole.orientation)


def _resize(picture: Image.Image, longest_px: int, is_smoothed: bool) -> Image.Image:
    ratio = max(max(picture.size) / longest_px, 1.0)
    size = [max(round(side / ratio), 2) for side in picture.size]
    return picture.resize((size[0], size[1]), Image.Resampling.BOX if is_smoothed else Image.Resampling.NEAREST)
