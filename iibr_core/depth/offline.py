"""A rough guess at depth without any model: things stand lower in the picture, and edges lie before them, the nearer
they are.

Two cues are kept: the height in the picture, and how much change of colour lies on the way from the upper border, which
shows what is far. Sharpness, haze, saturation, brightness and a prior for the middle did not help
on all photos with known depth.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
import OpenImageIO as oiio

from iibr_core.depth.estimate import RelativeInverseDepth
from iibr_core.kernels import kernel
from iibr_core.types import FloatImage, Photo

LONGEST_PX = 400
"""Depth is guessed on a picture so large."""
DETAIL_PX = 4
"""Radius of three box blurs there: finer detail is texture."""
STEP_COST = 0.0005
"""Of one pixel of way, against 1 for the change from black to white in one channel."""
WAY_SHARE = 2.0
"""How much the way counts against the height."""
SWEEPS = 3
"""To and fro; more change nothing that can be seen."""
GUIDE_PX = 8
"""Radius in which depth is linear in the photo's brightness: its edges become the photo's."""
GUIDE_CONTRAST = 0.03
"""Brightness that varies by less than this (standard deviation) draws no edge of depth."""


def estimate_offline(photo: Photo) -> RelativeInverseDepth:
    """Rough inverse depth (H, W) of a photo, finite; 0 everywhere where the picture gives no hint (one row of pixels).

    On teddy, moebius, motorcycle and antinous its correlation with the true disparity is 0.5 to 0.86 (docs/depth.md).
    """
    pixels = np.clip(photo.pixels, 0, 1)
    small = _resized(pixels, _small_size(photo.size), "box")
    smooth = small
    for _ in range(3):
        smooth = _averaged(smooth, DETAIL_PX)
    way = _way_from_top(smooth)
    depth = _standardised(np.indices(way.shape, np.float32)[0]) + WAY_SHARE * _standardised(way)
    return RelativeInverseDepth(_guided(depth, small.mean(axis=2), pixels))


def _small_size(size: tuple[int, int]) -> tuple[int, int]:
    ratio = min(1.0, LONGEST_PX / max(size))
    return max(round(size[0] * ratio), 1), max(round(size[1] * ratio), 1)


def _resized(image: FloatImage, size: tuple[int, int], filter_name: str) -> FloatImage:
    """(H, W, C) at another (height, width)."""
    if image.shape[:2] == size:
        return image
    source = oiio.ImageBuf(np.ascontiguousarray(image, np.float32))
    roi = oiio.ROI(0, size[1], 0, size[0], 0, 1, 0, image.shape[2])
    resized = oiio.ImageBufAlgo.resize(source, filtername=filter_name, roi=roi)
    return np.asarray(resized.get_pixels(oiio.FLOAT), np.float32).reshape(*size, image.shape[2])


def _way_from_top(image: FloatImage) -> FloatImage:
    """(H, W): length of the shortest way from the upper border, in changes of colour of an (H, W, 3) picture."""
    way = np.full(image.shape[:2], np.inf, np.float32)
    way[0] = 0
    _grow_way(np.ascontiguousarray(image, np.float32), way)
    return way


def _averaged(image: FloatImage, radius: int) -> FloatImage:
    """Means over squares, (H, W, ...); at the frame over what of them lies inside."""
    for axis in (0, 1):
        count = image.shape[axis]
        sums = np.insert(np.cumsum(image, axis=axis, dtype=np.float64), 0, 0.0, axis=axis)
        first, last = np.maximum(np.arange(count) - radius, 0), np.minimum(np.arange(count) + radius + 1, count)
        widths = (last - first).reshape([-1 if a == axis else 1 for a in range(image.ndim)])
        image = ((np.take(sums, last, axis) - np.take(sums, first, axis)) / widths).astype(np.float32)
    return image


def _standardised(values: FloatImage) -> FloatImage:
    """Mean 0, standard deviation 1; 0 where all are equal."""
    spread = float(values.std())
    return (values - values.mean()) / np.float32(spread) if spread > 1e-9 else np.zeros_like(values)


def _guided(values: FloatImage, guide: FloatImage, pixels: FloatImage) -> FloatImage:
    """The map (h, w), guided by a picture (h, w), at the size of the photo (H, W, 3), which guides it there.

    He et al., Guided Image Filtering, PAMI 2013, in its fast form: the linear model is enlarged, not the map.
    """
    products = np.stack([values, guide, guide * values, guide * guide], axis=2)
    mean, guide_mean, product, square = np.moveaxis(_averaged(products, GUIDE_PX), 2, 0)
    gain = (product - guide_mean * mean) / (square - guide_mean**2 + GUIDE_CONTRAST**2)
    model = _averaged(np.stack([gain, mean - gain * guide_mean], axis=2), GUIDE_PX)
    model = _resized(model, pixels.shape[:2], "triangle")
    return model[..., 0] * pixels.mean(axis=2) + model[..., 1]


@kernel
def _grow_way(image, way):  # type: ignore[no-untyped-def]
    """Shortest ways from the pixels where `way` (H, W) is 0, over 8 neighbours, sweeping to and fro."""
    height, width, channels = image.shape
    for sweep in range(2 * SWEEPS):
        to = 1 if sweep % 2 == 0 else -1
        for row in range(height):
            y = row if to > 0 else height - 1 - row
            for column in range(width):
                x = column if to > 0 else width - 1 - column
                for n in range(4):
                    # Those that this sweep has been to: beside, then the three of the row before.
                    v = y if n == 0 else y - to
                    u = x - to if n == 0 else x + n - 2
                    if not (0 <= v < height and 0 <= u < width):
                        continue
                    change = 0.0
                    for c in range(channels):
                        change += (image[y, x, c] - image[v, u, c]) ** 2
                    length = way[v, u] + sqrt(change) + STEP_COST * (1.0 if u == x or v == y else sqrt(2.0))
                    if length < way[y, x]:
                        way[y, x] = length
