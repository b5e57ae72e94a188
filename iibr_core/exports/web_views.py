"""The views of a light field as a web page carries them: which of them, how large, how finely, in what container.

Views differ little, so all lie in one moving picture (AVIF), a frame a view from the middle outwards: half the size of
single files or less (docs/web.md). Disparity goes the same way, in 8 bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, convert, encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.rendering.resized_light import mean_of_areas
from iibr_core.types import SRGB, ColorSpace, FloatImage, GridShape, ImageSize, ViewOffset, ViewUpdate, image_size

MOST_TEXELS = 56_000_000
"""Of all views together: a browser keeps each as six bytes."""
MOST_SIDE_PX = 4096
"""What graphics cards of phones take."""
MOST_VIEWS = 256
"""What every WebGL 2 takes."""
RANGE_MARGIN, OUTLIERS = 0.05, 0.0002
"""The range of disparities is that of the desktop's texture, see `light_field_texture.py`."""
QUALITY, DEPTH_QUALITY, FIRST_QUALITY = 84, 70, 60
SPEED = 8
"""Of the AV1 encoder, 0 to 10: 6 takes four times as long for a third less."""
FIRST_SIDE_PX = 1600
FRAME_MS = 40

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class WebForm:
    """What a page takes of a field. every: of the views across and down. scale: of their size. quality: of colours,
    1 to 100. is_single: a file a view, for browsers that read no frames of moving pictures.
    """

    every: int = 1
    scale: float = 1.0
    quality: int = QUALITY
    is_single: bool = False

    def size_of(self, size: ImageSize) -> ImageSize:
        """Of a view of that size."""
        return ImageSize(*(max(round(side * self.scale), 1) for side in size))

    def takes(self, offset: ViewOffset) -> bool:
        """Whether the view there is among them: the middle one always is."""
        return offset.t % self.every == 0 == offset.s % self.every


@dataclass(frozen=True, eq=False)
class WebViews:
    """Views in a container, their files in the order of `places`, from the middle outwards. range_px: what the least
    and the greatest byte of a disparity mean, px per view step of this size. depths: none where nothing is known.
    """

    form: WebForm
    size: ImageSize
    places: tuple[ViewOffset, ...]
    range_px: tuple[float, float]
    kind: str
    first: bytes
    colors: tuple[bytes, ...]
    depths: tuple[bytes, ...]

    @property
    def byte_count(self) -> int:
        """In the page, where three bytes are four letters."""
        return sum(4 * -(-len(data) // 3) for data in (self.first, *self.colors, *self.depths))


def form_that_fits(grid: GridShape, size: ImageSize, is_single: bool) -> WebForm:
    """All views at their size, as far as browsers can hold that: else every second one, and smaller ones."""
    for every in range(1, max(grid) + 1):
        form = WebForm(every, min(1.0, MOST_SIDE_PX / max(size)), is_single=is_single)
        count, (height, width) = len(_places(grid, form)), form.size_of(size)
        if count <= MOST_VIEWS and count * height * width <= MOST_TEXELS:
            break
    return form


def _places(grid: GridShape, form: WebForm) -> list[ViewOffset]:
    """From the middle outwards, ring by ring, round each: neighbours in time are so in space."""
    every = (grid.offset(row, column) for row in range(grid.rows) for column in range(grid.columns))

    def key(place: ViewOffset) -> tuple[float, float]:
        return max(abs(place.t), abs(place.s)), float(np.arctan2(place.t, place.s))

    return sorted(filter(form.takes, every), key=key)


class ViewStore:
    """The views that a form takes, in 8 bits, to be encoded more than once."""

    def __init__(self, grid: GridShape, form: WebForm, source: ColorSpace, space: ColorSpace) -> None:
        """source: the colours' space; space: that of the page."""
        self._grid, self._form, self._source, self._space = grid, form, source, space
        self._colors: dict[ViewOffset, Bytes] = {}
        self._disparities: dict[ViewOffset, Bytes] = {}
        self.range_px = (0.0, 0.0)

    def fill(self, views: Iterable[ViewUpdate]) -> None:
        """Keep what is needed; the first one, the middle, says what range of disparities there is."""
        for view in views:
            offset = self._grid.offset(view.row, view.column)
            if not self._form.takes(offset):
                continue
            self._colors[offset] = self._resized(self._converted(view))
            if view.disparity is not None:
                self._keep_disparity(offset, view.disparity)

    def _converted(self, view: ViewUpdate) -> Bytes:
        if view.colors.dtype == np.uint8 and self._source == self._space:
            return view.colors.view(np.uint8)
        return bytes_from_encoded(convert(encoded_from_stored(view.colors), self._space, self._source))

    def _resized(self, colors: Bytes) -> Bytes:
        size = self._form.size_of(image_size(colors))
        if size == image_size(colors):
            return colors
        return bytes_from_encoded(srgb_from_linear(mean_of_areas(linear_from_srgb(colors / np.float32(255)), size)))

    def _keep_disparity(self, offset: ViewOffset, disparity: FloatImage) -> None:
        size = self._form.size_of(image_size(disparity))
        rows, columns = (((np.arange(n) + 0.5) * (m / n)).astype(int) for n, m in zip(size, disparity.shape))
        values = disparity[np.ix_(rows, columns)] * np.float32(size.width / disparity.shape[1])
        if self.range_px == (0.0, 0.0):
            far, near = np.quantile(values, [OUTLIERS, 1 - OUTLIERS])
            margin = RANGE_MARGIN * (near - far) + 1e-3
            self.range_px = float(far - margin), float(near + margin)
        far, near = self.range_px
        levels = np.clip((values - far) * np.float32(255 / (near - far)), 0, 255)
        self._disparities[offset] = np.rint(levels).astype(np.uint8)

    def encode(self, form: WebForm) -> WebViews:
        """form: the store's, with any quality, or fewer of its views."""
        places = [place for place in _places(self._grid, form) if place in self._colors]
        colors = [self._colors[place] for place in places]
        depths = [self._disparities[place] for place in places if place in self._disparities]
        depths = depths if len(depths) == len(colors) else []
        return WebViews(
            form,
            image_size(colors[0]),
            tuple(places),
            self.range_px,
            "image/avif",
            encode_first(colors[0], self._space),
            tuple(_files(colors, form, form.quality, self._space)),
            tuple(_files(depths, form, DEPTH_QUALITY, SRGB)),
        )


def encode_first(colors: Bytes, space: ColorSpace) -> bytes:
    """What shows before any script has run, or where none can draw."""
    from PIL import Image

    image = Image.fromarray(colors)
    image.thumbnail((FIRST_SIDE_PX, FIRST_SIDE_PX), Image.Resampling.BOX)
    return _avif([image], FIRST_QUALITY, space, "4:2:0")


def _files(pictures: Sequence[Bytes], form: WebForm, quality: int, space: ColorSpace) -> Iterator[bytes]:
    from PIL import Image

    images = [Image.fromarray(picture) for picture in pictures]
    for group in [[image] for image in images] if form.is_single else [images] if images else []:
        yield _avif(group, quality, space, "4:4:4" if group[0].mode == "RGB" else "4:0:0")


def _avif(images: list[Any], quality: int, space: ColorSpace, subsampling: str) -> bytes:
    from iibr_core.formats.images.icc_profile import icc_profile

    told: dict[str, Any] = {} if space == SRGB else {"icc_profile": icc_profile(space)}
    if len(images) > 1:
        told |= {"save_all": True, "append_images": images[1:], "duration": FRAME_MS}
    packed = BytesIO()
    images[0].save(packed, "AVIF", quality=quality, speed=SPEED, subsampling=subsampling, **told)
    return packed.getvalue()
