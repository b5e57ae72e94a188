"""The lens: a picture is the mean, in linear light, of the views of pinhole cameras spread over its aperture, each
sheared to the focus. This is the reference for all engines; shaders/lens.frag is the fast one.

Views are added one by one, and none is kept.
"""

from __future__ import annotations

import math

import numpy as np

from iibr_core.beyond.optics import Optics
from iibr_core.method.look_up import KEYS_A, keys_weights
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, ImageSize, ViewOffset, image_size

ON_SURFACE_ROUNDS = 5
"""Number of steps in which a ray is followed to its surface if a range of disparities is in focus."""

BEYOND_BORDER = 1e-4
"""Weight of mirrored pixels outside a view: real pixels of other views count more."""


class LensSum:
    """A picture through a lens, as a sum of views."""

    def __init__(self, optics: Optics, size: ImageSize, is_hdr: bool = False) -> None:
        """Start without views. size: that of the picture and of every view. Dolly and gloss are left out."""
        self._optics, self._size = optics, size
        self._gain = optics.highlight_gain(optics.aperture_diameter, is_hdr)
        self._sum = np.zeros((*size, 3), np.float32)
        self._weights = np.zeros(size, np.float32)

    def add(
        self,
        offset: ViewOffset,
        colors: FloatImage,
        weight: float = 1.0,
        disparity: FloatImage | None = None,
    ) -> None:
        """Add the view (H, W, 3), sRGB-encoded, of a camera at an offset from the centre view in view steps.

        disparity: that of the view (H, W), px per view step; needed if the optics have a focus range.
        """
        optics = self._optics
        camera = offset.t - optics.eye.t, offset.s - optics.eye.s
        focus_range = 0.0 if disparity is None else max(optics.focus_range, 0.0)
        surface = np.zeros((1, 1), np.float32) if disparity is None else disparity
        focus = optics.focus_disparity, optics.focus_tilt, focus_range
        barrel = _barrel(optics, self._size)

        def shear(first: int, last: int) -> None:
            _add_sheared(light, surface, camera, weight, focus, barrel, (first, last), (self._sum, self._weights))

        light = light_of(colors, self._gain)
        in_bands(shear, self._size)

    def light(self) -> FloatImage:
        """Return the picture of the views added so far, linear light (H, W, 3), exposed; not cut off at white."""
        exposure = np.float32(2.0**self._optics.exposure_stops)
        return np.asarray(self._sum * (exposure / np.maximum(self._weights, np.float32(1e-9)))[..., None])


def light_of(colors: FloatImage, gain: float) -> FloatImage:
    """Return the linear light (H, W, 3) of encoded colours; what clips in all channels is 1 + gain times as bright."""
    light = np.empty(colors.shape, np.float32)
    in_bands(lambda first, last: _linear_rows(colors, gain, first, last, light), image_size(colors))
    return light


def _barrel(optics: Optics, size: ImageSize) -> tuple[float, float, float]:
    """Return the displacement (t, s) of a cat's-eye's barrel across the picture, and its radius, 0 without one."""
    if optics.aperture_shape.kind != "cat_eye":
        return 0.0, 0.0, 0.0
    radius, aspect = optics.aperture_diameter / 2, size.height / size.width
    across = 2 * optics.aperture_shape.cat_eye * radius / math.hypot(1.0, aspect)
    return across * aspect, across, radius


@kernel
def _linear_rows(encoded, gain, first, last, light):
    """Write linear light of rows [first, last); pixels that clip in all channels are 1 + gain times as bright."""
    for y in range(first, last):
        for x in range(encoded.shape[1]):
            red, green = linear_scalar(encoded[y, x, 0]), linear_scalar(encoded[y, x, 1])
            blue = linear_scalar(encoded[y, x, 2])
            clipped = min(max(20.0 * math.sqrt(max(min(red, green, blue), 0.0)) - 19.0, 0.0), 1.0)
            factor = 1.0 + gain * clipped * clipped
            light[y, x, 0], light[y, x, 1], light[y, x, 2] = factor * red, factor * green, factor * blue


@kernel
def _mirrored(index, size):
    """Return the index of a pixel, of its mirror image if it lies outside."""
    if index < 0:
        index = -index - 1
    if index >= size:
        index = 2 * size - 1 - index
    return min(max(index, 0), size - 1)


@kernel
def _add_sheared(light, disparity, camera, weight, focus, barrel, rows, sums):
    """Add rows [first, last) of a view, sheared to the focus, see `LensSum.add`.

    focus: disparity, tilt (right, down) and range. barrel: (t, s, radius).
    """
    total, weights = sums
    height, width = total.shape[:2]
    (t, s), (middle, (tilt_x, tilt_y), focus_range), (barrel_t, barrel_s, radius) = camera, focus, barrel
    for y in range(*rows):
        v = (y + 0.5) / height - 0.5
        for x in range(width):
            u = (x + 0.5) / width - 0.5
            w = weight
            if radius > 0 and math.hypot(t - barrel_t * v, s - barrel_s * u) > radius:
                w *= np.float32(1e-6)
            in_focus = middle + 2.0 * (tilt_x * u + tilt_y * v)
            sharp = in_focus
            if focus_range > 0:
                for _ in range(ON_SURFACE_ROUNDS):
                    row = _mirrored(math.floor(y - sharp * t + 0.5), height)
                    column = _mirrored(math.floor(x - sharp * s + 0.5), width)
                    sharp = min(max(disparity[row, column], in_focus - focus_range), in_focus + focus_range)
            at_y, at_x = y - sharp * t, x - sharp * s
            if not (-0.5 <= at_y <= height - 0.5 and -0.5 <= at_x <= width - 0.5):
                w *= np.float32(BEYOND_BORDER)
                at_y, at_x = min(max(at_y, -height), 2.0 * height), min(max(at_x, -width), 2.0 * width)
            top, left = math.floor(at_y), math.floor(at_x)
            weights_y = keys_weights(np.float32(at_y - top), KEYS_A)
            weights_x = keys_weights(np.float32(at_x - left), KEYS_A)
            red = green = blue = np.float32(0.0)
            for j in range(4):
                row = _mirrored(top + j - 1, height)
                for i in range(4):
                    column = _mirrored(left + i - 1, width)
                    tap = weights_y[j] * weights_x[i]
                    red += tap * light[row, column, 0]
                    green += tap * light[row, column, 1]
                    blue += tap * light[row, column, 2]
            weights[y, x] += w
            total[y, x, 0] += w * red
            total[y, x, 1] += w * green
            total[y, x, 2] += w * blue
