"""Preparation of a photo for a depth network, as the JSON files in the model's folder state it."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from iibr_core.formats.files import read_text, reason_of
from iibr_core.types import FloatImage, ImageSize, InputError

CONFIG, PREPROCESSOR = "config.json", "preprocessor_config.json"


@dataclass(frozen=True)
class Preparation:
    """Preparation of a photo for a network: size and multiple of the sides in pixels, colours 0..1 normalised."""

    size: ImageSize
    keeps_aspect: bool
    multiple: int
    mean: tuple[float, ...]
    std: tuple[float, ...]

    def size_for(self, photo: ImageSize) -> ImageSize:
        """Return the size to which a photo is resized: the side that changes least meets the model's size.

        The input of a long photo has at most 2.5 times the area that the model was made for, and two patches a side.
        """
        scale_y, scale_x = self.size.height / photo.height, self.size.width / photo.width
        if self.keeps_aspect:
            scale_y = scale_x = min(scale_y, scale_x, key=lambda scale: abs(1 - scale))
        sides = np.array([scale_y * photo.height, scale_x * photo.width])
        area = 2.5 * self.size.height * self.size.width
        sides *= min(1.0, (area / sides.prod()) ** 0.5)
        short, long = (max(round(side / self.multiple), 2) * self.multiple for side in sorted(sides))
        long = max(min(long, int(area / short) // self.multiple * self.multiple), short)
        return ImageSize(short, long) if sides[0] <= sides[1] else ImageSize(long, short)


USUAL_PREPARATION = Preparation(ImageSize(518, 518), True, 14, (0.485, 0.456, 0.406), (0.229, 0.224, 0.225))
"""Depth Anything V2's preparation."""
PLAIN_COLORS = replace(USUAL_PREPARATION, mean=(0.0, 0.0, 0.0), std=(1.0, 1.0, 1.0))
"""Preparation of networks that normalise colours themselves: they take RGB from 0 to 1."""


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
    settings = read_object(folder / PREPROCESSOR)
    try:
        size = settings.get("size", usual.size._asdict())
        height, width = (size["height"], size["width"]) if isinstance(size, dict) else (size, size)
        white = 255 * settings.get("rescale_factor", 1 / 255) if settings.get("do_rescale", True) else 255
        is_normalized = settings.get("do_normalize", True)
        mean = settings.get("image_mean", usual.mean) if is_normalized else 0
        std = settings.get("image_std", usual.std) if is_normalized else 1
        preparation = Preparation(
            ImageSize(int(height), int(width)),
            bool(settings.get("keep_aspect_ratio", usual.keeps_aspect)),
            max(int(settings.get("ensure_multiple_of", usual.multiple)), 1),
            tuple(np.broadcast_to(np.asarray(mean, np.float32), 3) / white),
            tuple(np.broadcast_to(np.asarray(std, np.float32), 3) / white),
        )
        if not 1 <= min(height, width) <= max(height, width, preparation.multiple) <= 4096:
            raise ValueError("sides of 1 to 4096 pixels are possible")
        if 0 in preparation.std or not np.isfinite(preparation.mean + preparation.std).all():
            raise ValueError("mean and deviation must be finite, and the deviation not 0")
    except (TypeError, ValueError, KeyError, ArithmeticError) as error:
        raise InputError(f"{folder / PREPROCESSOR}: makes no sense ({reason_of(error)})") from error
    return preparation


def read_object(path: Path) -> dict[str, Any]:
    """Return the object in a JSON file, empty if there is no file. Raises InputError if it is damaged."""
    if not path.is_file():
        return {}
    try:
        return dict(json.loads(read_text(path)).items())
    except (ValueError, AttributeError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({reason_of(error)}); get it again") from error
