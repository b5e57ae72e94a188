"""Depth maps drawn in colours, as depth models show them: the colours are looked up in their scale."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage

HUES = "HSV"
"""Name of the scale of hues, which ends as it begins."""
SCALES = {
    "turbo": "30123b 4040a2 466be3 4293ff 28bbec 18dcc3 31f299 6bfe64 a2fc3c cced34 edd03a fdad35 fb8022 ec520f d23105"
    " ac1701 7a0403",
    "jet": "000080 0000c0 0000ff 003fff 007fff 00bfff 01fefe 40ffc0 80ff80 c0ff40 fefe01 ffbf00 ff7f00 ff3f00 ff0000"
    " c00000 800000",
    "inferno": "000004 0b0724 210c4a 3d0965 56106e 70196e 89226a a32c61 bb3654 d14545 e35932 f1721e f98c0a fcaa0f"
    " f9c932 f2e865 fcffa4",
    "magma": "000004 0a0822 1d1147 36106b 50127c 691c81 822681 9c2e7f b6367a cf4070 e65164 f46a5c fb8861 fea571 fec287"
    " fde0a1 fcfdbf",
    "plasma": "0d0887 310597 4c02a1 6600a7 7e03a8 9511a1 a92395 bc3587 cc4678 d9596a e56b5d f07f4f f89441 fdab33"
    " fdc328 f9dd25 f0f921",
    "viridis": "440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21908c 1f9f88 27ad81 3ebc74 5cc863 82d34d"
    " aadc32 d5e21a fde725",
    "cividis": "00224e 002e6a 1a386f 32436d 434e6c 535a6d 61656f 6f7073 7c7c78 8b8778 9a9376 aaa073 bbad6d ccba64"
    " ddc858 efd748 fee838",
    HUES: "ff0000 ffff00 00ff00 00ffff 0000ff ff00ff ff0000",
    "Spectral": "5e4fa2 3288bd 66c2a5 abdda4 e6f598 ffffbf fee08b fdae61 f46d43 d53e4f 9e0142",
}
"""Colours at equal steps, from the low end to the high one, by the names of matplotlib and OpenCV."""
STEPS = 1024
MAX_MEDIAN_DISTANCE, MAX_DISTANCE = 8.0, 40.0
"""Largest distances from a scale, of 0..255, of half of a map's pixels and of 19 of 20."""
MIN_RANGE = 0.25
"""Smallest share of its scale that a map takes."""
COLORS_AT_ONCE = 4096
MARK_LEVELS = 12
"""Largest distance of black and white, which mark unknown values, from 0 and 255."""
MIN_MARKED_SHARE, MARKED_QUANTILE = 0.01, 0.7
"""Share of such pixels from which a lossy file mixes their colour into others, and share of pixels that it leaves."""
MAX_HUES_COST = 0.5
"""Largest cost of hues, as a share of the next scale's, with which they are recognised: other scales hold hues, too."""


class CyclicColorsError(ValueError):
    """The colours of a map run in a circle, so that near and far look alike."""


def values_of_colors(pixels: NDArray[Any]) -> tuple[FloatImage, str] | None:
    """Return places in a scale of colours (H, W), 0..1, and its name; None for pictures in other colours.

    Black and white are NaN, unless the scale holds them. pixels: (H, W, 3) uint8 or uint16. Raises CyclicColorsError.
    """
    shift = 8 * (pixels.dtype.itemsize - 1)
    red, green, blue = np.moveaxis((pixels[..., :3] >> shift).astype(np.uint32), 2, 0)
    packed = red << 16 | green << 8 | blue
    colors, where, counts = np.unique(packed.ravel(), return_inverse=True, return_counts=True)
    channels = np.stack([colors >> 16, colors >> 8 & 255, colors & 255])
    is_mark = (channels.max(axis=0) <= MARK_LEVELS) | (channels.min(axis=0) >= 255 - MARK_LEVELS)
    weights = np.where(is_mark, 0, counts)
    if not weights.any():
        return None
    found = {name: _nearest(colors, _scale(text)) for name, text in SCALES.items()}
    costs = {name: float((np.minimum(away, MAX_DISTANCE) * weights).sum()) for name, (_, away) in found.items()}
    name = min(costs.keys() - {HUES}, key=lambda scale: costs[scale])
    name = HUES if costs[HUES] < MAX_HUES_COST * costs[name] else name
    places, distances = found[name]
    order = np.argsort(distances)
    share = np.cumsum(weights[order]) / weights.sum()
    is_marked = counts @ is_mark > MIN_MARKED_SHARE * packed.size
    quantiles = 0.5, MARKED_QUANTILE if is_marked else 0.95
    median, large = (distances[order][np.searchsorted(share, quantile)] for quantile in quantiles)
    is_known = np.where(is_mark, distances <= MARK_LEVELS, ~is_marked | (distances <= MAX_DISTANCE))
    values = np.where(is_known, places, np.float32(np.nan))[where].reshape(packed.shape)
    if median > MAX_MEDIAN_DISTANCE or large > MAX_DISTANCE or np.ptp(np.nanpercentile(values, (2, 98))) < MIN_RANGE:
        return None
    if name == HUES:
        raise CyclicColorsError
    return values, name


def _scale(text: str) -> FloatImage:
    """Return the colours (STEPS, 3), 0..255, of a scale."""
    stops = np.array([list(bytes.fromhex(color)) for color in text.split()], np.float32)
    at = np.linspace(0, len(stops) - 1, STEPS)
    return np.stack([np.interp(at, np.arange(len(stops)), stops[:, c]) for c in range(3)], axis=1).astype(np.float32)


def _nearest(colors: NDArray[np.uint32], scale: FloatImage) -> tuple[FloatImage, FloatImage]:
    """Return the place of the nearest colour of a scale, 0..1, and its distance, for packed colours (N,)."""
    rgb = np.stack([colors >> 16, colors >> 8 & 255, colors & 255], axis=1).astype(np.float32)
    places, distances = np.empty(len(rgb), np.float32), np.empty(len(rgb), np.float32)
    for first in range(0, len(rgb), COLORS_AT_ONCE):
        part = rgb[first : first + COLORS_AT_ONCE]
        squares = (scale**2).sum(axis=1) - 2 * part @ scale.T + (part**2).sum(axis=1)[:, None]
        places[first : first + COLORS_AT_ONCE] = squares.argmin(axis=1) / np.float32(STEPS - 1)
        distances[first : first + COLORS_AT_ONCE] = np.sqrt(np.maximum(squares.min(axis=1), 0))
    return places, distances
