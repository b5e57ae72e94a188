"""A rough guess at depth without any model: the nearer things are, the lower they stand in the picture, and the more
edges lie between them and its upper border.

Both cues count the same: the height in the picture, and how much change of colour lies on the way from the upper
border, which shows what is far. Sharpness, haze, saturation, brightness, a prior for the middle, the way from the lower
border and from the sides did not help on all photos with known depth.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
import OpenImageIO as oiio

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import (
    FloatImage,
    ImageSize,
    Photo,
    image_size,
)

LONGEST_PX = 400
"""Depth is guessed on a picture so large."""
DETAIL_PX = 4
"""Radius of three box blurs there: finer detail is texture."""
STEP_COST = 0.0005
"""Of one pixel of way, against 1 for the change from black to white in one channel."""
SWEEPS = 3
"""To and fro; more change nothing that can be seen."""
GUIDE_PX = 8
"""Radius in which depth is linear in the photo's brightness: its edges become the photo's."""
GUIDE_CONTRAST = 0.03
"""Brightness that varies by less than this (standard deviation) draws no edge of depth."""


def estimate_from_cues(photo: Photo) -> DepthEstimate:
    """Rough inverse depth (H, W) of a photo, finite; 0 everywhere where the picture gives no hint (one row of pixels).

    Of pairs of points that differ in depth it orders 86 % rightly, the height alone 82 % (docs/depth.md).
    """
    pixels = np.clip(photo.pixels, 0, 1)
    small = resize_picture(pixels, _small_size(photo.size), "box")
    smooth = small
    for _ in range(3):
        smooth = box_filter(smooth, DETAIL_PX)
    raise_if_stopped()
    way = _way_from_top(smooth)
    raise_if_stopped()
    # Longer than usual tells little more: what stands upright before a plain sky then hardly leans.
    edges_crossed = way / np.maximum(way + np.median(way), STEP_COST)
    depth = _standardise(np.indices(way.shape, np.float32)[0]) + _standardise(edges_crossed)
    return DepthEstimate(_guided_upsample(depth, small.mean(axis=2), pixels), "inverse depth")


def _small_size(size: ImageSize) -> ImageSize:
    ratio = min(1.0, LONGEST_PX / max(size))
    return ImageSize(max(round(size.height * ratio), 1), max(round(size.width * ratio), 1))


def resize_picture(image: FloatImage, size: ImageSize, filter_name: str = "box") -> FloatImage:
    """A picture (H, W, C) at another (height, width), by one of OpenImageIO's filters: the box averages areas."""
    if image.shape[:2] == size:
        return image
    channels = image.shape[2]
    source, resized = (oiio.ImageBuf(oiio.ImageSpec(w, h, channels, oiio.FLOAT)) for h, w in (image.shape[:2], size))

    def put(first: int, last: int) -> None:
        rows = oiio.ROI(0, image.shape[1], first, last, 0, 1, 0, channels)
        source.set_pixels(rows, np.ascontiguousarray(image[first:last], np.float32))

    def resize(first: int, last: int) -> None:
        rows = oiio.ROI(0, size.width, first, last, 0, 1, 0, channels)
        oiio.ImageBufAlgo.resize(resized, source, filtername=filter_name, roi=rows)

    # OpenImageIO has threads of its own. A pixel of a smaller picture takes as long as all that it is the mean of.
    in_bands(put, image_size(image), threads=1)
    shrinkage = max(image.shape[0] * image.shape[1] / (size.height * size.width), 1.0)
    in_bands(resize, size, threads=1, most_pixels=int(tiling.MOST_BAND_PIXELS / shrinkage))
    return np.asarray(resized.get_pixels(oiio.FLOAT), np.float32).reshape(*size, channels)


def _way_from_top(image: FloatImage) -> FloatImage:
    """(H, W): length of the shortest way from the upper border, in changes of colour of an (H, W, 3) picture."""
    way = np.full(image.shape[:2], np.inf, np.float32)
    way[0] = 0
    _grow_way(np.ascontiguousarray(image, np.float32), way)
    return way


def box_filter(image: FloatImage, radius: int) -> FloatImage:
    """Means over squares of 2 * radius + 1 pixels, (H, W, ...); at the frame over what of them lies inside.

    scipy's would save 7 of 12 ms, and cost the window 140 MB of installation.
    """
    for axis in (0, 1):
        count = image.shape[axis]
        # A difference of running sums: the cost does not depend on the radius. float64, as the sums grow large.
        sums = np.insert(np.cumsum(image, axis=axis, dtype=np.float64), 0, 0.0, axis=axis)
        first, last = np.maximum(np.arange(count) - radius, 0), np.minimum(np.arange(count) + radius + 1, count)
        widths = (last - first).reshape([-1 if a == axis else 1 for a in range(image.ndim)])
        image = ((np.take(sums, last, axis) - np.take(sums, first, axis)) / widths).astype(np.float32)
    return image


def _standardise(values: FloatImage) -> FloatImage:
    """Mean 0, standard deviation 1; 0 where all are equal."""
    spread = float(values.std())
    return (values - values.mean()) / np.float32(spread) if spread > 1e-9 else np.zeros_like(values)


def _guided_upsample(values: FloatImage, guide: FloatImage, pixels: FloatImage) -> FloatImage:
    """The map (h, w), guided by a picture (h, w), at the size of the photo (H, W, 3), which guides it there.

    He et al., Guided Image Filtering, PAMI 2013, in its fast form: the linear model is enlarged, not the map.
    """
    # The regression of the map on the guide in every square: gain = covariance / (variance + contrast^2).
    products = np.stack([values, guide, guide * values, guide * guide], axis=2)
    mean, guide_mean, product, square = np.moveaxis(box_filter(products, GUIDE_PX), 2, 0)
    gain = (product - guide_mean * mean) / (square - guide_mean**2 + GUIDE_CONTRAST**2)
    # Every pixel lies in many squares: it takes the mean of their models.
    model = box_filter(np.stack([gain, mean - gain * guide_mean], axis=2), GUIDE_PX)
    model = resize_picture(model, image_size(pixels), "triangle")
    guided = np.empty(pixels.shape[:2], np.float32)

    def band(first: int, last: int) -> None:
        rows = slice(first, last)
        guided[rows] = model[rows, :, 0] * pixels[rows].mean(axis=2) + model[rows, :, 1]

    in_bands(band, image_size(pixels))
    return guided


@kernel
def _grow_way(image, way):
    """Shortest ways from the pixels where `way` (H, W) is 0, over 8 neighbours, sweeping to and fro."""
    height, width, channels = image.shape
    # Geodesic distance by raster scans (Toivanen 1996): there and back instead of the queue of Dijkstra.
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
                    # The way over this neighbour: root of the summed squares of the change in colour, and the step
                    # itself.
                    change = 0.0
                    for c in range(channels):
                        change += (image[y, x, c] - image[v, u, c]) ** 2
                    length = way[v, u] + sqrt(change) + STEP_COST * (1.0 if u == x or v == y else sqrt(2.0))
                    if length < way[y, x]:
                        way[y, x] = length
