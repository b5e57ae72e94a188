"""Photos made smaller while they are read: area averages of linear light, of a few rows of the file at a time.

So neither a huge file's bytes nor its floats are ever whole in memory.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import linear_from_srgb
from iibr_core.formats.images.color_profile import color_profile_of
from iibr_core.formats.images.oiio_reader import Raster, full_scale
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import ShouldStop, never, raise_if_stopped
from iibr_core.types import FloatImage, ImageSize

BAND_ROWS = 32
MOST_ROWS_PIXELS = 1 << 20
"""Of the file, as floats at the same time."""


class Rows(Protocol):
    """A picture that gives its rows from top to bottom: a file (`PictureRows`), or what is decoded already."""

    @property
    def size(self) -> ImageSize:
        """Of the whole picture."""

    def read(self, first: int, last: int) -> Raster:
        """Rows [first, last): none that lie above those of the call before, none left out."""


class OddValues(NamedTuple):
    """How many pixels held NaN or infinity, and the largest finite value of all."""

    pixels: int
    largest: float


def downsampled_linear(
    open_rows: Callable[[], Rows], size: ImageSize, should_stop: ShouldStop = never
) -> tuple[FloatImage, bool, OddValues]:
    """A picture's linear light over black at a smaller (height, width): (H, W, 3), whether it is opaque, and what of it
    was not finite: NaN counts as black, infinity as the largest value there is.

    open_rows: gives the picture from its first row on; asked again where infinity is met, as what replaces it is not
    known before the end. Raises InputError as reading its rows does, Cancelled once should_stop is true.
    """
    averages = _Averages(open_rows(), size)
    result = averages.result(should_stop)
    if averages.has_infinity:
        result = _Averages(open_rows(), size, _instead_of_infinity(averages.odd.largest)).result(should_stop)
    return result, averages.is_opaque, averages.odd


def linear_light(raster: Raster) -> FloatImage:
    """Linear light over black, (H, W, 3), of finite pixels; by the profile that comes with them, of its space.

    HDR photos exceed white, 1, as floating-point files do.
    """
    pixels = raster.pixels
    profile = color_profile_of(raster.spec)[0]
    if profile is not None and pixels.dtype.kind == "u":
        linear: NDArray[Any] = profile.linear(np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels)
    elif pixels.dtype.kind == "u":
        steps = full_scale(pixels.dtype)
        linear = linear_from_srgb(np.arange(steps + 1, dtype=np.float32) / steps)[pixels]
    else:
        linear = np.maximum(pixels, 0)
    if raster.alpha is not None and raster.spec.get_int_attribute("oiio:UnassociatedAlpha"):
        alpha = np.nan_to_num(raster.alpha.astype(np.float32) / full_scale(raster.alpha.dtype))
        linear = linear * np.clip(alpha, 0, 1)[..., None]
    return np.ascontiguousarray(np.repeat(linear, 3, axis=2) if linear.shape[2] == 1 else linear, np.float32)


def finite_pixels(pixels: NDArray[Any], infinity: float | None = None) -> tuple[NDArray[Any], OddValues]:
    """Pixels (H, W, C) with NaN as 0 and infinity as `infinity`, by default the largest finite value; and what was odd.

    Without any finite value the largest is -inf, and 1 stands in.
    """
    if pixels.dtype.kind == "u":
        return pixels, OddValues(0, -math.inf)
    finite = np.isfinite(pixels)
    largest = float(pixels.max(initial=-np.inf, where=finite))
    if finite.all():
        return pixels, OddValues(0, largest)
    if infinity is None:
        infinity = _instead_of_infinity(largest)
    cleaned = np.nan_to_num(pixels, nan=0.0, posinf=infinity, neginf=0.0)
    return cleaned, OddValues(int((~finite).any(axis=2).sum()), largest)


def _instead_of_infinity(largest: float) -> float:
    return max(largest, 0.0) if math.isfinite(largest) else 1.0


class _Averages:
    """One pass over a picture; what it learns on the way is known after `result`."""

    def __init__(self, rows: Rows, size: ImageSize, infinity: float = 0.0) -> None:
        self._rows, self._size, self._infinity = rows, size, infinity
        self.is_opaque, self.has_infinity, self.odd = True, False, OddValues(0, -math.inf)
        self._seen = 0

    def result(self, should_stop: ShouldStop) -> FloatImage:
        height, stored = self._size.height, self._rows.size
        result, row_step = np.empty((*self._size, 3), np.float32), stored.height / height
        most_rows = max(1, int(MOST_ROWS_PIXELS / stored.width / row_step))
        for top in range(0, height, BAND_ROWS):
            bottom = min(top + BAND_ROWS, height)
            # Areas are counted from the band's first row of the file, however few of its rows are there at a time.
            band = _rows_under(top, bottom, height, stored.height)
            for first in range(top, bottom, most_rows):
                raise_if_stopped(should_stop)
                last = min(first + most_rows, bottom)
                lines = range(first - top, last - top)
                here = _rows_under(first, last, height, stored.height)
                # Rounded, an area may begin or end a row farther out; one without any weight does no harm.
                here = range(max(here.start - 1, band.start), min(here.stop + 1, band.stop))
                linear = self._linear(here)
                _average_areas(
                    linear,
                    here.start - band.start,
                    band.start,
                    len(band),
                    row_step,
                    top,
                    lines.start,
                    result[first:last],
                )
        return result

    def _linear(self, rows: range) -> FloatImage:
        raster = self._rows.read(rows.start, rows.stop)
        pixels, odd = finite_pixels(raster.pixels, self._infinity)
        if odd.pixels:
            self.has_infinity = self.has_infinity or bool(np.isposinf(raster.pixels).any())
        new = raster.pixels[max(self._seen - rows.start, 0) :]
        self._seen = max(self._seen, rows.stop)
        count = int((~np.isfinite(new)).any(axis=2).sum()) if odd.pixels else 0
        self.odd = OddValues(self.odd.pixels + count, max(self.odd.largest, odd.largest))
        self.is_opaque = self.is_opaque and raster.alpha is None
        return linear_light(Raster(pixels, raster.alpha, raster.spec))


def _rows_under(first: int, last: int, height: int, stored_height: int) -> range:
    """The rows of a file that rows [first, last) of `height` cover."""
    return range(first * stored_height // height, min(stored_height, -(-last * stored_height // height)))


@kernel
def _average_areas(rows, first_row, band_top, band_rows, row_step, result_top, first_line, result):
    """Average rows (n, W, 3) over the area of each pixel of result (m, w, 3).

    Pixel i of the whole result covers rows i * row_step .. (i + 1) * row_step of the whole source. band_top and
    result_top: the first rows of a band in both wholes, band_rows: of the source that are in it. first_row and
    first_line: where within the band `rows` and `result` begin.
    """
    column_step = rows.shape[1] / result.shape[1]
    for y in range(result.shape[0]):
        # Exact area averages: border rows and columns count by the share that lies inside.
        y0 = (result_top + first_line + y) * row_step - band_top
        y1 = min(y0 + row_step, float(band_rows))
        for x in range(result.shape[1]):
            x0 = x * column_step
            x1 = min(x0 + column_step, float(rows.shape[1]))
            red, green, blue, area = 0.0, 0.0, 0.0, 0.0
            for row in range(max(int(y0), 0), min(math.ceil(y1), band_rows)):
                covered_rows = min(y1, row + 1.0) - max(y0, float(row))
                for column in range(int(x0), min(math.ceil(x1), rows.shape[1])):
                    weight = covered_rows * (min(x1, column + 1.0) - max(x0, float(column)))
                    red += weight * rows[row - first_row, column, 0]
                    green += weight * rows[row - first_row, column, 1]
                    blue += weight * rows[row - first_row, column, 2]
                    area += weight
            result[y, x, 0] = red / area
            result[y, x, 1] = green / area
            result[y, x, 2] = blue / area
