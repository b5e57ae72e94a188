"""Linear light at another size: the mean over areas."""

from __future__ import annotations

import math

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, ImageSize, image_size


def mean_of_areas(
    light: FloatImage, size: ImageSize, area: tuple[float, float, float, float] | None = None
) -> FloatImage:
    """Return light (H, W, 3) at another (height, width), each pixel the mean over its area.

    area: part of the light that is shown, (top, left, height, width) in pixels of it, all by default. Light that would
    not change is returned itself.
    """
    everything = 0.0, 0.0, float(light.shape[0]), float(light.shape[1])
    area = area or everything
    if image_size(light) == size and area == everything:
        return light
    means = np.empty((*size, 3), np.float32)
    in_bands(lambda first, last: average_areas(light, area, first, last, means), size)
    return means


@kernel
def average_areas(light, area, first, last, means):
    """Fill rows [first, last) of means (H, W, 3) with means over an area of light (h, w, 3), see `mean_of_areas`.

    Areas are exact: pixels count by the share of them that lies in the area.
    """
    top, left, height, width = area
    step_y, step_x = height / means.shape[0], width / means.shape[1]
    for row in range(first, last):
        y0, y1 = top + row * step_y, min(top + (row + 1) * step_y, float(light.shape[0]))
        for column in range(means.shape[1]):
            x0, x1 = left + column * step_x, min(left + (column + 1) * step_x, float(light.shape[1]))
            red = green = blue = total = 0.0
            for v in range(int(y0), math.ceil(y1)):
                covered = min(y1, v + 1.0) - max(y0, float(v))
                for u in range(int(x0), math.ceil(x1)):
                    w = covered * (min(x1, u + 1.0) - max(x0, float(u)))
                    red += w * light[v, u, 0]
                    green += w * light[v, u, 1]
                    blue += w * light[v, u, 2]
                    total += w
            means[row, column, 0] = red / total
            means[row, column, 1] = green / total
            means[row, column, 2] = blue / total
