"""Linear light at another size: the mean over areas."""

from __future__ import annotations

import math

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, ImageSize, image_size


def mean_of_areas(
    light: FloatImage,
    size: ImageSize,
    area: tuple[float, float, float, float] | None = None,
) -> FloatImage:
    """Light (h, w, 3) at another (height, width): the mean over each pixel's area; the same array where it has that
    size. area: what of the light it shows, top, left, height and width in pixels of it; None: all.
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
