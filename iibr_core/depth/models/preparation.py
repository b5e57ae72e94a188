"""Preparation of a photo for a depth network, as the JSON files in the model's folder state it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from iibr_core.formats.files import is_file, read_text, reason_of
from iibr_core.types import FloatImage, ImageSize, InputError

CONFIG, PREPROCESSOR = "config.json", "preprocessor_config.json"
MAX_SIDE = 4096
MAX_AREA_GROWTH = 2.5
"""Largest area of a long photo's input, as a multiple of the area that the model was made for."""


@dataclass(frozen=True)
class Preparation:
    """Preparation of a photo for a network: size and multiple of the sides in pixels, colours 0..1 normalised."""

    size: ImageSize
    keeps_aspect: bool
    multiple: int
    mean: tuple[float, ...]
    std: tuple[float, ...]

    def size_for(self, photo: ImageSize) -> ImageSize:
        """Return the size to which a photo is resized: the side that changes least meets the model's size."""
        scale_y, scale_x = self.size.height / photo.height, self.size.width / photo.width
        if self.keeps_aspect:
            scale_y = scale_x = min(scale_y, scale_x, key=lambda scale: abs(1 - scale))
        sides = np.array([scale_y * photo.height, scale_x * photo.width])
        area = MAX_AREA_GROWTH * self.size.height * self.size.width
        sides *= min(1.0, (area / sides.prod()) ** 0.5)
        # Networks halve what they see: two patches at least.
        short, long = (max(round(side / self.multiple), 2) * self.multiple for side in sorted(sides))
        long = max(min(long, int(area / short) // self.multiple * self.multiple), short)
        return ImageSize(short, long) if sides[0] <= sides[1] else ImageSize(long, short)


USUAL_PREPARATION = Preparation(ImageSize(518, 518), True, 14, (0.485, 0.456, 0.406), (0.229, 0.224, 0.225))
"""Depth Anything V2's preparation."""


def network_input(pixels: FloatImage, preparation: Preparation, size: ImageSize) -> FloatImage:
    """Return pixels (H, W, 3), 0..1, as (1, 3, height, width): resized by an antialiased cubic kernel, normalised."""
    planes = np.empty((1, 3, *size), np.float32)
    for c, (mean, deviation) in enumerate(zip(preparation.mean, preparation.std)):
        plane = Image.fromarray(np.clip(pixels[..., c], 0, 1).astype(np.float32))
        resized = np.asarray(plane.resize((size.width, size.height), Image.Resampling.BICUBIC))
        planes[0, c] = (resized - mean) / deviation
    return planes


def read_preparation(folder: Path, usual: Preparation = USUAL_PREPARATION) -> Preparation:
    """Return the preparation that a folder's preprocessor_config.json states; `usual` for what it leaves out.

    Raises InputError if it is damaged or impossible.
    """
    path = folder / PREPROCESSOR
    settings = read_object(path)
    try:
        height, width = _pair(settings.get("size", usual.size))
        white = 255 * settings.get("rescale_factor", 1 / 255) if settings.get("do_rescale", True) else 255
        is_normalized = settings.get("do_normalize", True)
        mean = settings.get("image_mean", usual.mean) if is_normalized else 0
        std = settings.get("image_std", usual.std) if is_normalized else 1
        preparation = Preparation(
            ImageSize(height, width),
            bool(settings.get("keep_aspect_ratio", usual.keeps_aspect)),
            max(int(settings.get("ensure_multiple_of", usual.multiple)), 1),
            tuple(np.broadcast_to(np.asarray(mean, np.float32), 3) / white),
            tuple(np.broadcast_to(np.asarray(std, np.float32), 3) / white),
        )
    except (TypeError, ValueError, KeyError, ArithmeticError) as error:
        raise InputError(f"{path}: makes no sense ({reason_of(error)})") from error
    is_possible = min(height, width) >= 1 and max(height, width, preparation.multiple) <= MAX_SIDE
    if not is_possible or 0 in preparation.std or not np.isfinite(preparation.mean + preparation.std).all():
        raise InputError(f"{path}: size, multiple, mean or deviation of {preparation} make no sense")
    return preparation


def read_object(path: Path) -> dict[str, Any]:
    """Return the object in a JSON file, empty if there is no file. Raises InputError if it is damaged."""
    if not is_file(path):
        return {}
    try:
        found = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({reason_of(error)}); get it again") from error
    if not isinstance(found, dict):
        raise InputError(f"{path}: damaged (no object); get it again")
    return found


def _pair(size: Any) -> tuple[int, int]:
    """Return (height, width) of a size as settings state it: an object, a pair, or one side of a square."""
    if isinstance(size, dict):
        size = size["height"], size["width"]
    height, width = (size, size) if isinstance(size, int) else size
    return int(height), int(width)
