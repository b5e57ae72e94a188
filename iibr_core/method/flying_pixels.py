"""Flying pixels: single pixels of a view that stand out though the photo's pixels do not.

Beside depth edges a map's errors tear rays off their surface: alone among others, they catch the eye. A ray that stands
out from what surrounds it in the view by far more than it does in the photo was torn off, and takes the median of what
surrounds it. Thin things stand out in the photo, too, and stay; so does what shows between them, and all that lies
within one surface or was inpainted.
"""

from __future__ import annotations

from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import (
    FloatImage,
    Margins,
    ViewOffset,
    image_size,
)

Colors = TypeVar("Colors", bound=NDArray[Any])

STANDS_OUT = 0.05
STANDS_OUT_FACTOR = 3.0
"""A ray may differ from the median of its 3x3 pixels by this factor more than in the photo, and by STANDS_OUT besides,
in sRGB-encoded values.
"""
TEARING_GAP_PX = 2.0
"""Step of the photo that tears rays off, in px in the outermost view. With 1 px, exact maps lose 0.04 dB: thin things
disappear.
"""
UNREACHED_DETAIL = 1e6
"""Detail that no pixel of a view exceeds."""


def measure_detail(photo: FloatImage, tears: NDArray[np.bool_]) -> FloatImage:
    """Return how far (H, W) each pixel of a photo (H, W, 3) is, in any channel, from the median of its 3x3 pixels.

    tears (H, W): where rays may be torn off. All other pixels have UNREACHED_DETAIL.
    """
    detail = np.where(tears, np.float32(0.0), np.float32(UNREACHED_DETAIL))
    in_bands(lambda first, last: _measure(photo, tears, first, last, detail), image_size(detail))
    return detail


def without_flying_pixels(
    colors: Colors,
    disparity: FloatImage,
    inpainted: NDArray[np.bool_],
    detail: FloatImage,
    offset: ViewOffset,
    margins: Margins,
    threads: int | None = 1,
) -> Colors:
    """Return the colours (H, W, 3) of a view, sRGB-encoded, as floats or as they are stored, without flying pixels.

    disparity, inpainted (H, W): of the view. detail: `measure_detail` of the photo with its margins, UNREACHED_DETAIL
    where no ray is torn off. threads: None for all cores.
    """
    # Kernels know no half precision.
    shown = colors.astype(np.float32) if colors.dtype == np.float16 else colors
    replaced, white = shown.copy(), 255.0 if colors.dtype == np.uint8 else 1.0
    to_photo = (float(offset.t), float(offset.s)), (margins.top, margins.left)

    def band(first: int, last: int) -> None:
        _replace_flying(shown, white, disparity, inpainted, detail, to_photo, (first, last), replaced)

    in_bands(band, image_size(disparity), threads)
    return cast(Colors, replaced.astype(colors.dtype, copy=False))


@kernel
def _measure(photo, tears, first, last, detail):
    """Write rows [first, last) of `measure_detail`."""
    for y in range(first, last):
        for x in range(detail.shape[1]):
            if tears[y, x]:
                for channel in range(3):
                    detail[y, x] = max(detail[y, x], abs(photo[y, x, channel] - _median(photo, y, x, channel)))


@kernel
def _replace_flying(colors, white, disparity, inpainted, detail, to_photo, rows, replaced):
    """Write flying pixels of rows [first, last) to replaced, which holds the colours.

    to_photo: view offset (t, s) and margins (top, left) of the photo.
    """
    (t, s), (top, left) = to_photo
    lowest, rightmost = detail.shape[0] - 1, detail.shape[1] - 1
    for y in range(*rows):
        for x in range(disparity.shape[1]):
            v, u = y + disparity[y, x] * t + top, x + disparity[y, x] * s + left
            v, u = min(max(v, 0.0), lowest), min(max(u, 0.0), rightmost)
            if inpainted[y, x] or detail[nearest_pixel(v), nearest_pixel(u)] >= UNREACHED_DETAIL:
                continue
            red, green, blue = _median(colors, y, x, 0), _median(colors, y, x, 1), _median(colors, y, x, 2)
            stands_out = max(abs(colors[y, x, 0] - red), abs(colors[y, x, 1] - green), abs(colors[y, x, 2] - blue))
            if stands_out > white * (STANDS_OUT + STANDS_OUT_FACTOR * _interpolated(detail, v, u)):
                replaced[y, x, 0], replaced[y, x, 1], replaced[y, x, 2] = red, green, blue


@kernel
def _median(colors, y, x, channel):
    """Return the median of the 3x3 pixels around one, as a float: a difference of bytes has no sign."""
    above, below = max(y - 1, 0), min(y + 1, colors.shape[0] - 1)
    left, right = max(x - 1, 0), min(x + 1, colors.shape[1] - 1)
    upper = _ordered(colors[above, left, channel], colors[above, x, channel], colors[above, right, channel])
    middle = _ordered(colors[y, left, channel], colors[y, x, channel], colors[y, right, channel])
    lower = _ordered(colors[below, left, channel], colors[below, x, channel], colors[below, right, channel])
    low, high = max(upper[0], middle[0], lower[0]), min(upper[2], middle[2], lower[2])
    return float(_ordered(low, _ordered(upper[1], middle[1], lower[1])[1], high)[1])


@kernel
def _ordered(a, b, c):
    return min(a, b, c), max(min(a, b), min(max(a, b), c)), max(a, b, c)


@kernel
def _interpolated(image, y, x):
    """Return the value of an image (H, W) between four of its pixels."""
    row, column = int(y), int(x)
    below, right = min(row + 1, image.shape[0] - 1), min(column + 1, image.shape[1] - 1)
    down, across = y - row, x - column
    upper = (1 - across) * image[row, column] + across * image[row, right]
    return (1 - down) * upper + down * ((1 - across) * image[below, column] + across * image[below, right])
