"""Quilts: the views of a light-field display as tiles of one picture (Looking Glass).

View 0 is the leftmost one, at the bottom left; the next ones follow to the right, then in the row above. The last,
rightmost view is at the top right.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import COPY
from iibr_core.types import ImageSize, InputError

USUAL_VIEWS = 8, 6
"""Columns and rows of a quilt for any display."""
MAX_USUAL_SIDE_PX = 4096
MAX_VIEWS = 1024
MIN_ASPECT = 0.01
TAG = re.compile(
    r"(?:_qs|(?:quilt|light[-_ ]?field)[-_ ]?)(\d{1,6})x(\d{1,6})"
    rf"(?:a(\d{{1,6}}(?:\.\d{{0,9}})?))?(?:z[\d.]+)?(?:f-?[\d.]+)?(?:[-_]\d{{1,6}})?{COPY}$",
    re.IGNORECASE,
)
"""End of the stem of a quilt's name: columns and rows, and aspect where pixels are not square; then zoom, focus, number
of a frame or copy.
"""


@dataclass(frozen=True)
class Quilt:
    """Columns and rows of tiles, and the size of the whole picture.

    aspect: width / height of a tile on the display, which stretches tiles of another shape.
    """

    columns: int
    rows: int
    size: ImageSize
    aspect: float

    @property
    def views(self) -> int:
        """Number of views."""
        return self.columns * self.rows

    @property
    def tile(self) -> ImageSize:
        """Size of a view in pixels; the remainder of the picture stays black."""
        return ImageSize(self.size.height // self.rows, self.size.width // self.columns)

    @property
    def tag(self) -> str:
        """End of the file's stem, which players read."""
        return f"_qs{self.columns}x{self.rows}a{round(self.aspect, 4):g}"

    def place(self, view: int) -> tuple[slice, slice]:
        """Return the rows and columns of a view in the whole, row 0 at the top."""
        (height, width), row, column = self.tile, view // self.columns, view % self.columns
        bottom = self.size.height - row * height
        return slice(bottom - height, bottom), slice(column * width, (column + 1) * width)


DEVICES = {
    "go": Quilt(11, 6, ImageSize(4092, 4092), 0.5625),
    "portrait": Quilt(8, 6, ImageSize(3360, 3360), 0.75),
    "16-landscape": Quilt(7, 7, ImageSize(5999, 5999), 1.777),
    "16-portrait": Quilt(11, 6, ImageSize(6000, 5995), 0.5625),
    "32-landscape": Quilt(7, 7, ImageSize(8190, 8190), 1.777),
    "32-portrait": Quilt(11, 6, ImageSize(8184, 8184), 0.5625),
    "65": Quilt(8, 9, ImageSize(8192, 8192), 1.777),
}
"""Recommended quilts of Looking Glass displays, by the names of the displays."""
SCREENS = {
    ImageSize(2560, 1440): "go",
    ImageSize(2048, 1536): "portrait",
    ImageSize(2160, 3840): "16-landscape",
    ImageSize(3840, 2160): "16-portrait",
    ImageSize(4320, 7680): "32-landscape",
    ImageSize(7680, 4320): "32-portrait",
}
"""Names of displays by the size of their screens; the 65 inch one has that of 32 inches, and shows its quilt."""


def quilt_named(path: Path, size: ImageSize) -> Quilt | None:
    """Return the quilt that a file's name states, None if it states none. size: size of the picture."""
    match = TAG.search(path.stem)
    if match is None:
        return None
    columns, rows = int(match[1]), int(match[2])
    if not (1 <= columns <= size.width and 1 <= rows <= size.height):
        raise InputError(f"{path}: {size} pixels are too few for {columns}x{rows} views; is its name right?")
    if columns * rows > MAX_VIEWS:
        raise InputError(f"{path}: {columns}x{rows} are more than {MAX_VIEWS} views; is its name right?")
    aspect = float(match[3]) if match[3] else (size.width // columns) / (size.height // rows)
    if not MIN_ASPECT <= aspect <= 1 / MIN_ASPECT:
        raise InputError(f"{path}: a view has no width / height of {aspect:g}; is its name right?")
    return Quilt(columns, rows, size, aspect)


def quilt_for(device: str | None, view: ImageSize) -> Quilt:
    """Return the quilt of a display; for None a quilt of USUAL_VIEWS, each in the shape of `view` and no larger."""
    if device is not None:
        if device not in DEVICES:
            raise InputError(f"{device!r} is not a known display: give {', '.join(DEVICES)}")
        return DEVICES[device]
    columns, rows = USUAL_VIEWS
    scale = min(1.0, MAX_USUAL_SIDE_PX / (columns * view.width), MAX_USUAL_SIDE_PX / (rows * view.height))
    height, width = (max(round(side * scale), 1) for side in view)
    return Quilt(columns, rows, ImageSize(rows * height, columns * width), view.width / view.height)


def lay_out(quilt: Quilt, tiles: Iterable[NDArray[Any]]) -> NDArray[np.uint8]:
    """Return the picture (H, W, 3) of a quilt. tiles: its views, the leftmost first, uint8 of size `quilt.tile`."""
    whole = np.zeros((*quilt.size, 3), np.uint8)
    for view, tile in zip(range(quilt.views), tiles, strict=True):
        whole[quilt.place(view)] = tile
    return whole


def tagged(path: Path, tag: str) -> Path:
    """Return the path with a tag at the end of its stem; unchanged if it is there."""
    return path if path.stem.endswith(tag) else path.with_name(f"{path.stem}{tag}{path.suffix}")
