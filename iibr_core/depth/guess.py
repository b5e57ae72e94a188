"""A rough guess at depth without any model, from two cues of equal weight: things are nearer if they are low in the
picture, and if many edges lie between them and its upper border, which is mostly far away.

Sharpness, haze, saturation, brightness, a prior for the middle, and paths from the other borders did not help on all
photos with known depth.
"""

from __future__ import annotations

import numpy as np
import OpenImageIO as oiio

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.geodesic import spread_distances
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage, ImageSize, Photo

LONGEST_PX = 400
"""Longer side of the picture on which depth is guessed."""
DETAIL_PX = 4
"""Radius of three box blurs of that picture: finer detail is texture."""
PIXEL_COST = 0.0005
"""Cost of one pixel of a path, where a step from black to white in one channel costs 1."""
GUIDE_PX = 8
"""Radius in which depth is linear in the photo's brightness, which draws the edges of depth along the photo's."""
GUIDE_CONTRAST = 0.03
"""Standard deviation of brightness below which it draws no edge of depth."""


def guess_depth(photo: Photo) -> DepthEstimate:
    """Return rough inverse depth (H, W) of a photo, finite; 0 everywhere in a photo of one row.

    It orders 85 % of the pairs of points that differ in depth correctly, the height alone 82 % (docs/accuracy.md).
    """
    pixels = np.clip(photo.pixels, 0, 1)
    small = resize_picture(pixels, size_within(photo.size, LONGEST_PX))
    smooth = small
    for _ in range(3):
        smooth = box_filter(smooth, DETAIL_PX)
    raise_if_stopped()
    path = np.full(smooth.shape[:2], np.inf, np.float32)
    path[0] = 0
    spread_distances(smooth, PIXEL_COST, path)
    raise_if_stopped()
    # Paths much longer than usual count little more: what stands before a plain sky then hardly leans.
    edges_crossed = path / np.maximum(path + np.median(path), PIXEL_COST)
    depth = _standardise(np.indices(path.shape, np.float32)[0]) + _standardise(edges_crossed)
    return DepthEstimate(_guided_upsample(depth, small.mean(axis=2), pixels), "inverse depth")


def size_within(size: ImageSize, longest_px: int) -> ImageSize:
    """Return the size of a picture whose longer side is reduced to longest_px."""
    ratio = min(1.0, longest_px / max(size))
    return ImageSize(max(round(size.height * ratio), 1), max(round(size.width * ratio), 1))


def resize_picture(image: FloatImage, size: ImageSize) -> FloatImage:
    """Return a picture (H, W, C) at a smaller (height, width), by means over areas."""
    if image.shape[:2] == size:
        return image
    channels = image.shape[2]
    region = oiio.ROI(0, size.width, 0, size.height, 0, 1, 0, channels)
    source = oiio.ImageBuf(np.ascontiguousarray(image, np.float32))
    resized = oiio.ImageBufAlgo.resize(source, filtername="box", roi=region)
    return np.asarray(resized.get_pixels(oiio.FLOAT), np.float32).reshape(*size, channels)


def box_filter(image: FloatImage, radius: int) -> FloatImage:
    """Return means over squares of 2 * radius + 1 pixels (H, W, ...), at the frame over the part inside."""
    for axis in (0, 1):
        count = image.shape[axis]
        # Differences of running sums: the cost does not depend on the radius. float64, because the sums grow large.
        sums = np.insert(np.cumsum(image, axis=axis, dtype=np.float64), 0, 0.0, axis=axis)
        first, last = np.maximum(np.arange(count) - radius, 0), np.minimum(np.arange(count) + radius + 1, count)
        widths = (last - first).reshape([-1 if a == axis else 1 for a in range(image.ndim)])
        image = ((np.take(sums, last, axis) - np.take(sums, first, axis)) / widths).astype(np.float32)
    return image


def _standardise(values: FloatImage) -> FloatImage:
    """Return values with mean 0 and standard deviation 1, or 0 if all are equal."""
    spread = float(values.std())
    return (values - values.mean()) / np.float32(spread) if spread > 1e-9 else np.zeros_like(values)


def _guided_upsample(values: FloatImage, guide: FloatImage, pixels: FloatImage) -> FloatImage:
    """Return a map (h, w), guided by a picture (h, w), at the size of the photo (H, W, 3), which guides it there.

    He et al., Guided Image Filtering, PAMI 2013, in its fast form: the linear model is enlarged, not the map.
    """
    # The regression of the map on the guide in every square: gain = covariance / (variance + contrast^2).
    products = np.stack([values, guide, guide * values, guide * guide], axis=2)
    mean, guide_mean, product, square = np.moveaxis(box_filter(products, GUIDE_PX), 2, 0)
    gain = (product - guide_mean * mean) / (square - guide_mean**2 + GUIDE_CONTRAST**2)
    # Every pixel lies in many squares: it takes the mean of their models.
    model = box_filter(np.stack([gain, mean - gain * guide_mean], axis=2), GUIDE_PX)
    size = ImageSize(*pixels.shape[:2])
    model = _interpolate(model, 1, np.arange(size.width), size.width)
    guided = np.empty(size, np.float32)

    def band(first: int, last: int) -> None:
        rows = _interpolate(model, 0, np.arange(first, last), size.height)
        guided[first:last] = rows[..., 0] * pixels[first:last].mean(axis=2) + rows[..., 1]

    in_bands(band, size)
    return guided


def _interpolate(image: FloatImage, axis: int, places: np.ndarray, count: int) -> FloatImage:
    """Return an image (h, w, C), linearly interpolated at these places of an axis that is enlarged to `count`."""
    length = image.shape[axis]
    at = np.clip((places + 0.5) * length / count - 0.5, 0, length - 1).astype(np.float32)
    low = at.astype(int)
    share = (at - low).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
    high = np.minimum(low + 1, length - 1)
    return np.asarray(image.take(low, axis) * (1 - share) + image.take(high, axis) * share)
