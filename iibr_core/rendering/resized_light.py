"""Linear light at another size: made smaller by the mean over areas; and changed so that it equals, made smaller, what
is given.
"""

from __future__ import annotations

import math

import numpy as np

from iibr_core.rendering.large_views import Part
from iibr_core.rendering.resampling import keys_weights
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.types import FloatImage, ImageSize, image_size

ENLARGED_BY = -0.5
"""Of Keys' cubic kernels (1981) the one that slopes come through unchanged."""
CORRECTION_ROUNDS = 2
"""Of bringing the picture, made smaller, to the one it is made of: an enlarged one, made smaller, is a bit softer."""


def bring_to(
    light: FloatImage, smaller: FloatImage, part: Part, size: ImageSize, should_stop: ShouldStop = never
) -> None:
    """Change light (h, w, 3), a part of a picture of (height, width), by as little as makes it equal `smaller`, the
    whole picture (H', W', 3), where it is made as small. Raises Cancelled once should_stop is true.

    What it holds that is finer than the pixels of `smaller` stays.
    """
    step_y, step_x = size.height / smaller.shape[0], size.width / smaller.shape[1]
    top, left = int(part.top / step_y), int(part.left / step_x)
    bottom, right = (min(math.ceil(a), n) for a, n in zip((part.bottom / step_y, part.right / step_x), smaller.shape))
    missing = np.empty((bottom - top, right - left, 3), np.float32)
    for _ in range(CORRECTION_ROUNDS):

        def lack(first: int, last: int) -> None:
            _mean_of_areas(light, float(part.top), float(part.left), step_y, step_x, top, left, first, last, missing)
            missing[first:last] = smaller[top + first : top + last, left:right] - missing[first:last]

        def give(first: int, last: int) -> None:
            _add_enlarged(missing, top, left, step_y, step_x, part.top, part.left, first, last, light)

        in_bands(lack, image_size(missing), should_stop)
        in_bands(give, part.size, should_stop)


def mean_of_areas(
    light: FloatImage,
    size: ImageSize,
    should_stop: ShouldStop = never,
    area: tuple[float, float, float, float] | None = None,
) -> FloatImage:
    """Light (h, w, 3) at another (height, width): the mean over each pixel's area; the same array where it has that
    size. area: what of the light it shows, top, left, height and width in pixels of it; None: all. Raises Cancelled
    once should_stop is true.
    """
    everything = 0.0, 0.0, float(light.shape[0]), float(light.shape[1])
    top, left, height, width = area or everything
    if image_size(light) == size and (top, left, height, width) == everything:
        return light
    means = np.empty((*size, 3), np.float32)
    step_y, step_x = height / size.height, width / size.width
    in_bands(
        lambda first, last: _mean_of_areas(light, -top, -left, step_y, step_x, 0, 0, first, last, means),
        size,
        should_stop,
    )
    return means


@kernel
def _mean_of_areas(light, top, left, step_y, step_x, first_row, first_column, first, last, means):
    """Fill rows [first, last) of means: of light, a part from (top, left) of a picture, over pixels of another that are
    step_y x step_x large, from (first_row, first_column) on. What lies outside the part does not count.
    """
    for row in range(first, last):
        y0 = max((first_row + row) * step_y - top, 0.0)
        y1 = min((first_row + row + 1) * step_y - top, float(light.shape[0]))
        for column in range(means.shape[1]):
            x0 = max((first_column + column) * step_x - left, 0.0)
            x1 = min((first_column + column + 1) * step_x - left, float(light.shape[1]))
            red = green = blue = area = 0.0
            # Exact areas: pixels on the border count by the share that lies inside.
            for v in range(int(y0), math.ceil(y1)):
                covered = min(y1, v + 1.0) - max(y0, float(v))
                for u in range(int(x0), math.ceil(x1)):
                    w = covered * (min(x1, u + 1.0) - max(x0, float(u)))
                    red += w * light[v, u, 0]
                    green += w * light[v, u, 1]
                    blue += w * light[v, u, 2]
                    area += w
            means[row, column, 0] = red / area if area > 0 else 0.0
            means[row, column, 1] = green / area if area > 0 else 0.0
            means[row, column, 2] = blue / area if area > 0 else 0.0


@kernel
def _add_enlarged(missing, first_row, first_column, step_y, step_x, top, left, first, last, light):
    """Add missing, interpolated, to rows [first, last) of light; where both lie: see `_mean_of_areas`."""
    rows, columns = missing.shape[0], missing.shape[1]
    for row in range(first, last):
        y = (top + row + 0.5) / step_y - 0.5 - first_row
        above = math.floor(y)
        weights_y = keys_weights(y - above, ENLARGED_BY)
        for column in range(light.shape[1]):
            x = (left + column + 0.5) / step_x - 0.5 - first_column
            before = math.floor(x)
            weights_x = keys_weights(x - before, ENLARGED_BY)
            red = green = blue = 0.0
            for j in range(4):
                v = min(max(above + j - 1, 0), rows - 1)
                for i in range(4):
                    u = min(max(before + i - 1, 0), columns - 1)
                    w = weights_y[j] * weights_x[i]
                    red += w * missing[v, u, 0]
                    green += w * missing[v, u, 1]
                    blue += w * missing[v, u, 2]
            light[row, column, 0] = max(light[row, column, 0] + red, 0.0)
            light[row, column, 1] = max(light[row, column, 1] + green, 0.0)
            light[row, column, 2] = max(light[row, column, 2] + blue, 0.0)
