"""How a photo becomes a depth network's input."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from PIL import Image

from iibr_core.types import FloatImage, ImageSize, InputError

MAX_AREA_GROWTH = 2.5
"""A long photo's input may hold this many times the pixels that the model was made for; time grows with its square."""


@dataclass(frozen=True)
class Preparation:
    """How a photo becomes a model's input.

    size: (height, width) it is made; keeps_aspect: then only one of the two is met. multiple: both sides are multiples
    of it. pads: whether mirrored borders are added first (ZoeDepth). mean, std: of each channel, 0..1.
    """

    size: ImageSize
    keeps_aspect: bool
    multiple: int
    pads: bool
    mean: tuple[float, ...]
    std: tuple[float, ...]


def affordable_pixels(
    title: str, weights_bytes: int, pixel_bytes: float, least_pixels: int, memory_bytes: int
) -> float:
    """Pixels of the input that the memory has room for beside the weights, pixel_bytes each.

    Raises InputError, naming the model, where they are fewer than least_pixels.
    """
    pixels = (memory_bytes - weights_bytes) / pixel_bytes
    if pixels < least_pixels:
        least = weights_bytes + least_pixels * pixel_bytes
        raise InputError(
            f"{title} takes {least / 2**20:,.0f} MiB, half of the free memory is {memory_bytes / 2**20:,.0f} MiB:"
            " choose a smaller model"
        )
    return pixels


def input_size(preparation: Preparation, size: ImageSize, max_pixels: float) -> ImageSize:
    """(height, width) that a photo is made for its model: as the model asks for, unless that exceeds max_pixels.

    The side that has to change least meets the model's size (as the library's own preparation chooses it).
    """
    height, width = size
    asked_height, asked_width = preparation.size
    scale_y, scale_x = asked_height / height, asked_width / width
    if preparation.keeps_aspect:
        scale_y = scale_x = scale_x if abs(1 - scale_x) < abs(1 - scale_y) else scale_y
    limit = min(max_pixels, MAX_AREA_GROWTH * asked_height * asked_width)
    shrink = min(1.0, math.sqrt(limit / (scale_y * height * scale_x * width)))
    rounded = round if shrink == 1 else math.floor
    sides = (scale_y * height * shrink, scale_x * width * shrink)
    multiple = preparation.multiple
    # Two patches at least: networks halve what they see once more.
    tall, wide = (max(rounded(side / multiple), 2) * multiple for side in sides)
    longest = max(2, int(limit / min(tall, wide)) // multiple) * multiple
    return ImageSize(min(tall, longest), min(wide, longest))


def network_input(pixels: FloatImage, preparation: Preparation, size: ImageSize) -> FloatImage:
    """(1, 3, height, width) float32: resized by an antialiased cubic kernel, then normalised channel by channel."""
    planes = np.empty((1, 3, *size), np.float32)
    for c, (mean, deviation) in enumerate(zip(preparation.mean, preparation.std)):
        plane = Image.fromarray(np.clip(pixels[..., c], 0, 1).astype(np.float32))
        resized = np.asarray(plane.resize((size.width, size.height), Image.Resampling.BICUBIC))
        planes[0, c] = (resized - mean) / deviation
    return planes
