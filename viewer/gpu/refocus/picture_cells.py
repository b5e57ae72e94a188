"""Parts of the picture whose rays cross one cell of the grid of views each, and the pixels that they take."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from iibr_core.scenes import Rect
from iibr_core.types import GridShape
from viewer.gpu.refocus.picture_lens import Lens


class PictureCell(NamedTuple):
    """A part of the picture in texture coordinates."""

    left: float
    top: float
    right: float
    bottom: float

    def within(self, rows: PictureCell) -> PictureCell | None:
        """What of it lies in these rows, None if nothing."""
        top, bottom = max(self.top, rows.top), min(self.bottom, rows.bottom)
        return PictureCell(self.left, top, self.right, bottom) if top < bottom else None

    def in_target(self, part: Rect) -> PictureCell:
        """The same in texture coordinates of targets that hold this part of the picture, as far as they do."""
        x = ((edge - part.x) / part.width for edge in (self.left, self.right))
        y = ((edge - part.y) / part.height for edge in (self.top, self.bottom))
        (left, right), (top, bottom) = ((min(max(edge, 0.0), 1.0) for edge in edges) for edges in (x, y))
        return PictureCell(left, top, right, bottom)


WHOLE_CELL = PictureCell(0.0, 0.0, 1.0, 1.0)


def cells_between_views(grid: GridShape, lens: Lens) -> Iterator[PictureCell]:
    """Parts of the picture whose rays cross one cell of the grid each; the whole picture without dolly."""
    if not lens.has_dolly:
        yield WHOLE_CELL
        return
    first, last = grid.offset(0, 0), grid.offset(grid.rows - 1, grid.columns - 1)
    across = _crossings(lens.eye.s, lens.dolly[0], first.s, last.s)
    down = _crossings(lens.eye.t, lens.dolly[1], first.t, last.t)
    for top, bottom in pairwise(down):
        for left, right in pairwise(across):
            yield PictureCell(left, top, right, bottom)


def pixels_of(cell: PictureCell, width: int, height: int) -> tuple[int, int, int, int]:
    """Scissor: (x, y, width, height) of the pixels whose cell this is."""
    left, top = round(cell.left * width), round(cell.top * height)
    return left, top, round(cell.right * width) - left, round(cell.bottom * height) - top


def covering_pixels(cell: PictureCell, width: int, height: int) -> tuple[int, int, int, int]:
    """Scissor: (x, y, width, height) of all pixels (here: tiles) that the cell and its border pixels lie in."""
    left, top = max(math.ceil(cell.left * width) - 1, 0), max(math.ceil(cell.top * height) - 1, 0)
    right, bottom = min(math.floor(cell.right * width) + 1, width), min(math.floor(cell.bottom * height) + 1, height)
    return left, top, right - left, bottom - top


def _crossings(eye: float, dolly: float, first: float, last: float) -> list[float]:
    """Texture coordinates along one axis where the ray passes a row or column of views, and the borders."""
    lines = np.arange(first, last + 1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        # Infinite, or NaN, with as good as no dolly along this axis: then no ray passes any.
        places = 0.5 + (lines - eye) / dolly
    return [0.0, *sorted(places[(places > 0) & (places < 1)].tolist()), 1.0]
