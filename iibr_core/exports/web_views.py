"""The views of a light field in a web page: their number, size, quality and container.

Views differ little, so they are the frames of streams (VP9), from the middle outwards: half the size of single files or
less. Disparity is stored the same way, in 8 bits. A moving picture (AVIF) serves where there is no encoder of VP9; not
every browser shows its frames.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.beyond.hidden_surfaces import HiddenSurface
from iibr_core.color import bytes_from_encoded, convert, encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.exports.web_streams import SMALL_SPEED, Stream, chroma_of, encode_levels, luma_of
from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.images.resized_light import mean_of_areas
from iibr_core.formats.maps.resample import nearest_pixels
from iibr_core.types import (
    DISPLAY_P3,
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

MAX_TEXELS = 56_000_000
"""Largest number of pixels of all views; a browser keeps each pixel as four bytes."""
MAX_SIDE_PX = 4096
"""Largest texture of the graphics cards of phones."""
MAX_VIEWS = 256
"""Number of texture layers that every WebGL 2 has."""
RANGE_MARGIN, OUTLIERS = 0.05, 0.0002
"""Margin and quantile of the disparity range, the same as in the desktop's texture (`light_field_texture.py`)."""
QUALITIES, DEPTH_QUALITY, FIRST_QUALITY = (82, 65, 48), 60, 50
"""Qualities of colours, the lower ones for budgets; of disparity; and of the first picture."""
CRFS, CHROMA_CRF_STEP, DEPTH_CRF = dict(zip(QUALITIES, (25, 32, 40))), 5, 32
"""Qualities of the streams of VP9, 0 to 63, the best first: of luma by the quality of colours, the step by which chroma
has a higher value, and of disparity."""
MAX_HALVINGS = 4
"""Largest number of times that a budget halves the size of the views."""
SPEED = 8
"""Speed of the AV1 encoder, 0 to 10: 6 takes four times as long for a third less."""
FIRST_SIDE_PX, FRAME_MS = 1600, 40
MOVING_RANGE = "limited"
"""Range of luma: Chromium 156 assumes it for moving pictures and ignores their `colr` boxes and sequence headers."""

Bytes = NDArray[np.uint8]


@dataclass(frozen=True)
class WebForm:
    """The part of a field that a page stores: every n-th view across and down, resized by `scale`.

    quality: of colours, 1 to 100. is_video: whether views are streams of VP9, not moving pictures in AVIF.
    """

    every: int = 1
    scale: float = 1.0
    quality: int = QUALITIES[0]
    is_video: bool = True

    def size_of(self, size: ImageSize) -> ImageSize:
        """Return the size in the page of a view of this size."""
        return ImageSize(*(max(round(side * self.scale), 1) for side in size))

    def takes(self, offset: ViewOffset) -> bool:
        """Return whether the page stores the view at this offset; it always stores the centre view."""
        return offset.t % self.every == 0 == offset.s % self.every


@dataclass(frozen=True, eq=False)
class WebViews:
    """Encoded views in the order of `places`, from the middle outwards, and the surface hidden behind the middle one.

    range_px: disparities of the bytes 0 and 255, px per view step of this size. has_disparity: whether all views have
    disparity. first: still picture of the middle view. streams: files by their names in `web/views.js`. pictures: the
    same for files in AVIF; of a page with streams, the middle view's disparity is one.
    """

    form: WebForm
    size: ImageSize
    places: tuple[ViewOffset, ...]
    range_px: tuple[float, float]
    has_disparity: bool
    first: bytes
    streams: Mapping[str, Stream]
    pictures: Mapping[str, bytes]

    @property
    def files(self) -> dict[str, bytes]:
        """All files of the views by name."""
        return {**{name: stream.data for name, stream in self.streams.items()}, **self.pictures}


def form_that_fits(grid: GridShape, size: ImageSize, is_video: bool, keeps_views: bool = False) -> WebForm:
    """Return the form with the most views, at their size, that browsers can hold in memory.

    keeps_views: whether too large views are made smaller rather than fewer.
    """
    for every in range(1, max(grid) + 1):
        form = WebForm(every, min(1.0, MAX_SIDE_PX / max(size)), is_video=is_video)
        count = len(places_of(grid, form))
        if keeps_views:
            form = replace(form, scale=min(form.scale, math.sqrt(MAX_TEXELS / (count * math.prod(size))) - 1e-3))
        height, width = form.size_of(size)
        if count <= MAX_VIEWS and count * height * width <= MAX_TEXELS:
            break
    return form


def places_of(grid: GridShape, form: WebForm) -> tuple[ViewOffset, ...]:
    """Return the stored views ring by ring from the middle, so that neighbouring frames are neighbouring views."""
    places = (grid.offset(row, column) for row in range(grid.rows) for column in range(grid.columns))
    return tuple(sorted(filter(form.takes, places), key=lambda at: (max(map(abs, at)), math.atan2(*at))))


class ViewStore:
    """The views of a form, in 8 bits, to be encoded more than once."""

    def __init__(self, grid: GridShape, form: WebForm, space: ColorSpace) -> None:
        """Begin without views. form: the grid that is stored. space: colour space of the views.

        The page has sRGB for sRGB views and Display P3 for others.
        """
        self._grid, self._form = grid, form
        self._of_views, self._space = space, SRGB if space == SRGB else DISPLAY_P3
        self._colors: dict[ViewOffset, Bytes] = {}
        self._disparities: dict[ViewOffset, Bytes] = {}
        self._hidden: list[tuple[Bytes, Bytes]] = []
        self._range_px = (0.0, 0.0)

    def add(self, view: ViewUpdate) -> None:
        """Store a view if the form takes it; the first one, the centre, determines the disparity range."""
        offset = self._grid.offset(view.row, view.column)
        if self._form.takes(offset):
            self._colors[offset] = self._converted(view)
            if view.disparity is not None:
                self._disparities[offset] = self._levels(view.disparity)

    def add_hidden(self, surface: HiddenSurface, centre: FloatImage) -> None:
        """Store the surface behind the centre view's, which has this disparity (H, W).

        Where nothing is known, it has the centre's disparity: no lens shows it there behind itself.
        """
        if np.array_equal(surface.disparity, centre):
            return
        colors = bytes_from_encoded(convert(surface.colors, self._space, self._of_views))
        self._hidden = [(colors, self._levels(np.where(surface.mask, surface.disparity, centre)))]

    def _converted(self, view: ViewUpdate) -> Bytes:
        if view.colors.dtype == np.uint8 and self._of_views == self._space:
            return view.colors.view(np.uint8).copy()
        return bytes_from_encoded(convert(encoded_from_stored(view.colors), self._space, self._of_views))

    def _levels(self, disparity: FloatImage) -> Bytes:
        if not self._disparities:
            far, near = np.quantile(disparity, [OUTLIERS, 1 - OUTLIERS])
            margin = RANGE_MARGIN * (near - far) + 1e-3
            self._range_px = float(far - margin), float(near + margin)
        far, near = self._range_px
        levels: Bytes = np.rint(np.clip((disparity - far) * np.float32(255 / (near - far)), 0, 255)).astype(np.uint8)
        return levels

    def encode(self, form: WebForm) -> WebViews:
        """Return the views in the store's form or a smaller one."""
        places = [place for place in places_of(self._grid, form) if place in self._colors]
        stored = image_size(self._colors[places[0]])
        size = form.size_of(stored)
        colors = [_smaller_colors(self._colors[place], size) for place in places]
        depths = [nearest_pixels(self._disparities[place], size) for place in places if place in self._disparities]
        far, near = (size.width / stored.width * value for value in self._range_px)
        has_disparity, is_video = len(depths) == len(colors), form.is_video
        for hidden_colors, levels in self._hidden if has_disparity else []:
            colors.append(_smaller_colors(hidden_colors, size))
            depths.append(nearest_pixels(levels, size))
        pictures = {} if is_video else {"colors": _moving(colors, form.quality, self._space, "4:4:4")}
        if has_disparity:
            pictures["depths"] = _moving(depths[: 1 if is_video else None], DEPTH_QUALITY, SRGB, "4:0:0")
        return WebViews(
            form,
            size,
            tuple(places),
            (far, near),
            has_disparity,
            _first_picture(colors[0], self._space),
            _streams(colors, depths if has_disparity else [], CRFS[form.quality]) if is_video else {},
            pictures,
        )

    def encode_within(self, budget: int, page_bytes: Callable[[WebViews], int]) -> WebViews:
        """Return the best views whose page, measured by `page_bytes`, has at most `budget` bytes.

        Lower quality is tried first, then every second view, then half the size, and so on. Raises InputError if the
        smallest page is too large.
        """
        for halvings, thinning in product(range(MAX_HALVINGS + 1), (1, 2)):
            every, scale = self._form.every * 2**halvings * thinning, self._form.scale / 2**halvings
            form = replace(self._form, every=every, scale=scale)
            smallest = self.encode(replace(form, quality=QUALITIES[-1]))
            if page_bytes(smallest) <= budget:
                better = (self.encode(replace(form, quality=quality)) for quality in QUALITIES[:-1])
                return next((views for views in better if page_bytes(views) <= budget), smallest)
        missing = (page_bytes(smallest) - budget) / 1e6
        raise InputError(f"budget: the smallest page is {missing:.2f} MB larger; give a larger budget")


def _smaller_colors(colors: Bytes, size: ImageSize) -> Bytes:
    if size == image_size(colors):
        return colors
    return bytes_from_encoded(srgb_from_linear(mean_of_areas(linear_from_srgb(colors / np.float32(255)), size)))


def _first_picture(colors: Bytes, space: ColorSpace) -> bytes:
    """Return the still picture (AVIF) that a page shows before its script runs, or if nothing can draw."""
    image = Image.fromarray(colors)
    image.thumbnail((FIRST_SIDE_PX, FIRST_SIDE_PX), Image.Resampling.BOX)
    return _avif([image], FIRST_QUALITY, space, "4:2:0")


def _streams(colors: Sequence[Bytes], depths: Sequence[Bytes], crf: int) -> dict[str, Stream]:
    """Return the streams of the views by name."""
    height, width = size = image_size(colors[0])
    chroma = map(chroma_of, colors), ImageSize(2 * height, width)
    streams = {
        "luma": encode_levels(map(luma_of, colors), size, crf),
        "chroma": encode_levels(*chroma, crf + CHROMA_CRF_STEP),
    }
    return streams | ({"disparity": encode_levels(depths, size, DEPTH_CRF, SMALL_SPEED)} if depths else {})


def _moving(pictures: Sequence[Bytes], quality: int, space: ColorSpace, subsampling: str) -> bytes:
    """Return pictures, colours (H, W, 3) or grey (H, W), as one moving picture."""
    return _avif([Image.fromarray(picture) for picture in pictures], quality, space, subsampling)


def _avif(images: list[Any], quality: int, space: ColorSpace, subsampling: str) -> bytes:
    options: dict[str, Any] = {} if space == SRGB else {"icc_profile": icc_profile(space)}
    if len(images) > 1:
        options |= {"save_all": True, "append_images": images[1:], "duration": FRAME_MS, "range": MOVING_RANGE}
    packed = BytesIO()
    images[0].save(packed, "AVIF", quality=quality, speed=SPEED, subsampling=subsampling, **options)
    return packed.getvalue()
