"""The views of a light field as a web page carries them: which of them, how large, how finely, in what container.

Views differ little, so all lie in one moving picture (AVIF), a frame a view from the middle outwards: half the size of
single files or less (docs/web.md). Disparity goes the same way, in 8 bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, convert, encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.rendering.resized_light import mean_of_areas
from iibr_core.types import (
    SRGB,
    ColorSpace,
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    ViewOffset,
    ViewUpdate,
    image_size,
)

MOST_TEXELS = 56_000_000
"""Of all views together: a browser keeps each as six bytes."""
MOST_SIDE_PX = 4096
"""What graphics cards of phones take."""
MOST_VIEWS = 256
"""What every WebGL 2 takes."""
RANGE_MARGIN, OUTLIERS = 0.05, 0.0002
"""The range of disparities is that of the desktop's texture, see `light_field_texture.py`."""
QUALITY, DEPTH_QUALITY, FIRST_QUALITY = 82, 60, 50
SPEED = 8
"""Of the AV1 encoder, 0 to 10: 6 takes four times as long for a third less."""
FINE_QUALITY, CHEAP_BITS = 95, 1.0
"""Of smooth pictures, which no quality makes large: of two views so many bits a pixel."""
FIRST_SIDE_PX = 1600
FRAME_MS = 40
MOVING_RANGE = "limited"
"""Of the bytes of luma: Chromium 156 reads moving pictures so, whatever their `colr` boxes and sequence headers say."""

Bytes = NDArray[np.uint8]


class Rung(NamedTuple):
    """A step towards smaller pages: every how many views, how large, the colours' quality."""

    every: int
    scale: float
    quality: int

    @property
    def share(self) -> float:
        """What it takes of a page of all views at QUALITY, about. Fewer views differ more, each from the next."""
        return float(QUALITIES[self.quality] * self.scale**1.7 * self.every**-1.4)


QUALITIES = {FINE_QUALITY: 2.2, QUALITY: 1.0, 68: 0.72, 58: 0.52, 48: 0.38}
"""What colours of a quality take, of those of the best."""
LADDER = tuple(
    Rung(every, scale, quality)
    for every, scale in (
        (1, 1.0),
        (2, 1.0),
        (2, 0.71),
        (2, 0.5),
        (4, 0.5),
        (4, 0.35),
        (64, 0.35),
        (64, 0.18),
        (64, 0.09),
    )
    for quality in QUALITIES
)


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

    def smaller(self, rung: Rung) -> WebForm:
        """Less of it."""
        scale = self.scale * rung.scale
        return replace(self, every=self.every * rung.every, scale=scale, quality=rung.quality)


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


NO_VIEWS = WebViews(WebForm(), ImageSize(1, 1), (), (0.0, 0.0), "image/avif", b"", (), ())
"""For the size of a page without them."""


def require_avif() -> None:
    """Raise InputError where Pillow was built without it."""
    from PIL import features

    if not features.check("avif"):
        raise InputError(
            "Pillow writes no AVIF here: install a wheel of it, with `pip install --force-reinstall pillow`"
        )


def form_that_fits(grid: GridShape, size: ImageSize, is_single: bool) -> WebForm:
    """All views at their size, as far as browsers can hold that: else every second one, and smaller ones."""
    for every in range(1, max(grid) + 1):
        form = WebForm(every, min(1.0, MOST_SIDE_PX / max(size)), is_single=is_single)
        count, (height, width) = len(places_of(grid, form)), form.size_of(size)
        if count <= MOST_VIEWS and count * height * width <= MOST_TEXELS:
            break
    return form


def places_of(grid: GridShape, form: WebForm) -> tuple[ViewOffset, ...]:
    """From the middle outwards, ring by ring, round each: neighbours in time are so in space."""
    every = (grid.offset(row, column) for row in range(grid.rows) for column in range(grid.columns))

    def key(place: ViewOffset) -> tuple[float, float]:
        return max(abs(place.t), abs(place.s)), float(np.arctan2(place.t, place.s))

    return tuple(sorted(filter(form.takes, every), key=key))


class ViewStore:
    """The views that a form takes, in 8 bits, to be encoded more than once."""

    def __init__(self, grid: GridShape, form: WebForm, source: ColorSpace, space: ColorSpace) -> None:
        """source: the colours' space; space: that of the page."""
        self._grid, self._form, self._source, self._space = grid, form, source, space
        self._colors: dict[ViewOffset, Bytes] = {}
        self._disparities: dict[ViewOffset, Bytes] = {}
        self._range_px = (0.0, 0.0)

    def fill(self, views: Iterable[ViewUpdate]) -> None:
        """Keep what is needed; the first one, the middle, says what range of disparities there is."""
        for view in views:
            offset = self._grid.offset(view.row, view.column)
            if not self._form.takes(offset):
                continue
            self._colors[offset] = self._converted(view)
            if view.disparity is not None:
                self._disparities[offset] = self._levels(view.disparity)

    def _converted(self, view: ViewUpdate) -> Bytes:
        if view.colors.dtype == np.uint8 and self._source == self._space:
            return view.colors.view(np.uint8).copy()
        return bytes_from_encoded(convert(encoded_from_stored(view.colors), self._space, self._source))

    def _levels(self, disparity: FloatImage) -> Bytes:
        if self._range_px == (0.0, 0.0):
            far, near = np.quantile(disparity, [OUTLIERS, 1 - OUTLIERS])
            margin = RANGE_MARGIN * (near - far) + 1e-3
            self._range_px = float(far - margin), float(near + margin)
        far, near = self._range_px
        levels: Bytes = np.rint(np.clip((disparity - far) * np.float32(255 / (near - far)), 0, 255)).astype(np.uint8)
        return levels

    def encode(self, form: WebForm) -> WebViews:
        """form: the store's, or less of it."""
        places = [place for place in places_of(self._grid, form) if place in self._colors]
        height, width = size = form.size_of(image_size(self._colors[places[0]]))
        colors = [_smaller_colors(self._colors[place], size) for place in places]
        depths = [_smaller_depth(self._disparities[place], size) for place in places if place in self._disparities]
        depths = depths if len(depths) == len(colors) else []
        scale = width / self._colors[places[0]].shape[1]
        return WebViews(
            form,
            ImageSize(height, width),
            tuple(places),
            (scale * self._range_px[0], scale * self._range_px[1]),
            "image/avif",
            encode_first(colors[0], self._space),
            tuple(_files(colors, form, form.quality, self._space)),
            tuple(_files(depths, form, DEPTH_QUALITY, SRGB)),
        )

    def fine_form(self) -> WebForm:
        """The store's, of finer colours where the first views say that they cost little."""
        first = [self._colors[place] for place in places_of(self._grid, self._form)[:2]]
        letters = sum(map(len, _files(first, self._form, FINE_QUALITY, self._space)))
        is_cheap = 8 * letters <= CHEAP_BITS * sum(colors[..., 0].size for colors in first)
        return replace(self._form, quality=FINE_QUALITY) if is_cheap else self._form

    def encode_within(self, letters: int) -> WebViews:
        """The best form of which so many letters are enough. Raises InputError where none is."""
        encoded, factor = None, 0.0
        for rung in LADDER:
            if encoded is not None and rung.share * factor > letters:
                continue
            encoded = self.encode(self._form.smaller(rung))
            if encoded.byte_count <= letters:
                return encoded
            factor = encoded.byte_count / rung.share
        least = 0 if encoded is None else encoded.byte_count
        raise InputError(f"--budget: the least page takes {(least - letters) / 1e6:.2f} MB more; give so much")


def _smaller_colors(colors: Bytes, size: ImageSize) -> Bytes:
    if size == image_size(colors):
        return colors
    return bytes_from_encoded(srgb_from_linear(mean_of_areas(linear_from_srgb(colors / np.float32(255)), size)))


def _smaller_depth(levels: Bytes, size: ImageSize) -> Bytes:
    """By nearest pixels: what lies between two surfaces is nowhere."""
    rows, columns = (((np.arange(n) + 0.5) * (m / n)).astype(int) for n, m in zip(size, levels.shape))
    smaller: Bytes = levels[np.ix_(rows, columns)]
    return smaller


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
        told |= {"save_all": True, "append_images": images[1:], "duration": FRAME_MS, "range": MOVING_RANGE}
    packed = BytesIO()
    images[0].save(packed, "AVIF", quality=quality, speed=SPEED, subsampling=subsampling, **told)
    return packed.getvalue()
