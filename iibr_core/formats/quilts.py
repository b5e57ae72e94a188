"""Quilts: the views of a light-field display as tiles of one picture (Looking Glass). View 0 is the leftmost, at the
bottom left; the next ones follow to the right, then in the row above; the last, rightmost, is at the top right.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import ImageSize, InputError

USUAL_VIEWS = 8, 6
USUAL_SIDE_PX = 4096
MOST_VIEWS_A_SIDE = 32
TAG = re.compile(r"_qs(\d{1,6})x(\d{1,6})a(\d{1,6}(?:\.\d{0,9})?)(?:[a-z][\d.]*)*$", re.IGNORECASE)
"""At the end of a name, maybe with more about the display."""


@dataclass(frozen=True)
class Quilt:
    """columns, rows: of tiles. size: of the whole in pixels. aspect: width / height of a tile as it is displayed: where
    the tile's pixels say otherwise, they are stretched there.
    """

    columns: int
    rows: int
    size: ImageSize
    aspect: float

    def __post_init__(self) -> None:
        if not (1 <= self.columns <= MOST_VIEWS_A_SIDE and 1 <= self.rows <= MOST_VIEWS_A_SIDE):
            raise InputError(f"a quilt of {self.columns}x{self.rows}: give 1 to {MOST_VIEWS_A_SIDE} views a side")
        if not 0.01 <= self.aspect <= 100:
            raise InputError(f"a quilt of aspect {self.aspect:g}: give width / height of a view, 0.01 to 100")

    @property
    def views(self) -> int:
        """How many."""
        return self.columns * self.rows

    @property
    def tile(self) -> ImageSize:
        """Of a view in pixels; what the whole has beyond that stays black."""
        return ImageSize(self.size.height // self.rows, self.size.width // self.columns)

    @property
    def tag(self) -> str:
        """What players read from the end of the file's name."""
        return f"_qs{self.columns}x{self.rows}a{round(self.aspect, 4):g}"

    def place(self, view: int) -> tuple[slice, slice]:
        """Rows and columns of a view in the whole, row 0 at the top."""
        (height, width), row, column = self.tile, view // self.columns, view % self.columns
        bottom = self.size.height - row * height
        return slice(bottom - height, bottom), slice(column * width, (column + 1) * width)


def quilt_named(path: Path, size: ImageSize) -> Quilt | None:
    """The quilt that a file's name speaks of, None where it does not. size: of the picture.

    Raises InputError for numbers of views that no quilt has, or that the picture is too small for.
    """
    match = TAG.search(path.stem)
    if match is None:
        return None
    try:
        quilt = Quilt(int(match[1]), int(match[2]), size, float(match[3]))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    if min(quilt.tile) < 1:
        raise InputError(
            f"{path}: {size} pixels are too few for {quilt.columns}x{quilt.rows} views; is its name right?"
        )
    return quilt


DEVICES = {
    "go": Quilt(11, 6, ImageSize(4092, 4092), 0.5625),
    "portrait": Quilt(8, 6, ImageSize(3360, 3360), 0.75),
    "16-landscape": Quilt(7, 7, ImageSize(5999, 5999), 1.777),
    "16-portrait": Quilt(11, 6, ImageSize(6000, 5995), 0.5625),
    "32-landscape": Quilt(7, 7, ImageSize(8190, 8190), 1.777),
    "32-portrait": Quilt(11, 6, ImageSize(8184, 8184), 0.5625),
    "65": Quilt(8, 9, ImageSize(8192, 8192), 1.777),
}
"""By the names of Looking Glass displays: what each asks for."""


def quilt_for(device: str | None, view: ImageSize) -> Quilt:
    """The quilt of a display, by its name; without one, of USUAL_VIEWS in the shape of `view`, no larger than it.

    Raises InputError for displays that nobody knows.
    """
    if device is not None:
        if device not in DEVICES:
            raise InputError(f"{device!r} is not a known display: give {', '.join(DEVICES)}")
        return DEVICES[device]
    columns, rows = USUAL_VIEWS
    scale = min(1.0, USUAL_SIDE_PX / (columns * view.width), USUAL_SIDE_PX / (rows * view.height))
    height, width = (max(round(side * scale), 1) for side in view)
    return Quilt(columns, rows, ImageSize(rows * height, columns * width), view.width / view.height)


def lay_out(quilt: Quilt, tiles: Iterable[NDArray[Any]]) -> NDArray[np.uint8]:
    """The quilt (H, W, 3) of its views, the leftmost first, each (h, w, 3) uint8 as large as `quilt.tile`.

    Raises ValueError where there are more or fewer, or one is of another size.
    """
    whole = np.zeros((*quilt.size, 3), np.uint8)
    count = 0
    for count, tile in enumerate(tiles, 1):
        if count > quilt.views or tile.shape[:2] != quilt.tile:
            raise ValueError(f"view {count} of {quilt.views} is {tile.shape[:2]}, the tiles are {quilt.tile}")
        whole[quilt.place(count - 1)] = tile
    if count != quilt.views:
        raise ValueError(f"{count} views for a quilt of {quilt.views}")
    return whole


def tagged(path: Path, tag: str) -> Path:
    """The path with a tag at the end of its stem, unless it ends so already."""
    return path if path.stem.endswith(tag) else path.with_name(f"{path.stem}{tag}{path.suffix}")
