"""A picture all around, as a rough surface reflects it: smoothed once by the surface's lobe, then looked up."""

from __future__ import annotations

from math import pi

import numpy as np

from iibr_core.beyond.resized_light import mean_of_areas
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, ImageSize, image_size

TEXELS_A_WIDTH = 2.0
LEAST_HEIGHT, MOST_HEIGHT = 16, 512
MOST_SMOOTHED = 256
"""Rows of a picture that is smoothed: its cost grows with their fourth power."""
REACH_WIDTHS = 3.0
"""Farther than so many widths from its middle a lobe counts as empty."""


def prefilter_environment(light: FloatImage, roughness: float) -> FloatImage:
    """An equirectangular picture (H, W, 3) of linear light as a surface of that roughness reflects it: (h, 2 h, 3).

    Values that are not finite count as black.
    """
    alpha = roughness**2
    wanted = round(pi * TEXELS_A_WIDTH / max(alpha, 1e-3))
    height = max(min(wanted, MOST_HEIGHT, max(light.shape[0], LEAST_HEIGHT)), LEAST_HEIGHT)
    finite = np.where(np.isfinite(light), np.maximum(light, 0), 0).astype(np.float32)
    is_sharp = alpha * height < 0.5 * pi
    height = height if is_sharp else min(height, MOST_SMOOTHED)
    small = mean_of_areas(finite, ImageSize(height, 2 * height))
    if is_sharp:
        return small
    smooth = np.empty_like(small)
    in_bands(lambda first, last: _smooth_rows(small, alpha, first, last, smooth), image_size(small))
    return smooth


@kernel
def _smooth_rows(light, alpha, first, last, smooth):
    """Rows [first, last) of the mean of `light` (h, 2h, 3) under GGX's lobe about each direction."""
    height, width = light.shape[:2]
    width2 = alpha * alpha
    polars = np.pi * (np.arange(height) + 0.5) / height
    sines, cosines = np.sin(polars), np.cos(polars)
    turns = np.cos(2 * np.pi * np.arange(width) / width)
    reach = REACH_WIDTHS * alpha * 2
    for y in range(first, last):
        rows = int(reach / np.pi * height) + 1
        for x in range(width):
            red, green, blue, total = 0.0, 0.0, 0.0, 0.0
            for v in range(max(y - rows, 0), min(y + rows + 1, height)):
                sine = sines[v]
                widest = reach / max(min(sine, sines[y]), 1e-3)
                columns = min(int(widest / (2 * np.pi) * width) + 1, width // 2)
                for k in range(-columns, columns + (columns < width // 2)):
                    cosine = cosines[y] * cosines[v] + sines[y] * sine * turns[abs(k)]
                    if cosine <= 0:
                        continue
                    # the half vector lies half as far away; 1 - cos^2 of half an angle
                    spread = width2 + (1 - width2) * 0.5 * (1 - cosine)
                    weight = sine * cosine / (spread * spread)
                    u = (x + k) % width
                    red += weight * light[v, u, 0]
                    green += weight * light[v, u, 1]
                    blue += weight * light[v, u, 2]
                    total += weight
            smooth[y, x, 0], smooth[y, x, 1], smooth[y, x, 2] = red / total, green / total, blue / total
