"""Pictures too large to be drawn at once, cut into parts that overlap as far as light is spread. No GL."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from iibr_core.scenes import WHOLE, Rect, ScreenSize

PART_PX = 2048
"""A part is no larger than this: its targets take about 70 bytes a pixel."""

MARGIN_PX = 128
"""Farther than smoothing reaches, see shaders/smooth.frag."""

ALIGNED_PX = 16
"""Parts begin at multiples of this, so that their tiles and half pixels are those of the whole."""


@dataclass(frozen=True)
class PictureTile:
    """A rectangle of a picture that is drawn, and what of it is kept.

    first_px, size_px: (x, y) and (width, height) of what is drawn. kept_from_px, kept_to_px: (x, y) in the picture.
    window: what is drawn, as a share of the picture.
    """

    first_px: tuple[int, int]
    size_px: ScreenSize
    kept_from_px: tuple[int, int]
    kept_to_px: tuple[int, int]
    window: Rect

    @property
    def kept(self) -> tuple[slice, slice]:
        """Rows and columns in the picture."""
        return slice(self.kept_from_px[1], self.kept_to_px[1]), slice(self.kept_from_px[0], self.kept_to_px[0])

    @property
    def kept_of_drawn(self) -> tuple[slice, slice]:
        """Rows and columns in what is drawn."""
        (x, y), (left, top), (right, bottom) = self.first_px, self.kept_from_px, self.kept_to_px
        return slice(top - y, bottom - y), slice(left - x, right - x)


def picture_tiles(size_px: ScreenSize, largest_px: int) -> list[PictureTile]:
    """Parts that together are kept as the whole picture, each at most largest_px wide and high.

    size_px: (width, height). A picture that can be drawn at once is one part, without margins.
    """
    side = min(PART_PX, largest_px)
    if max(size_px) <= side:
        return [PictureTile((0, 0), size_px, (0, 0), size_px, WHOLE)]
    (width, height), columns, rows = size_px, _spans(size_px[0], side), _spans(size_px[1], side)
    return [
        PictureTile(
            (x, y),
            ScreenSize(drawn_x, drawn_y),
            (from_x, from_y),
            (to_x, to_y),
            Rect(x / width, y / height, drawn_x / width, drawn_y / height),
        )
        for (y, drawn_y, from_y, to_y), (x, drawn_x, from_x, to_x) in product(rows, columns)
    ]


def _spans(length: int, side: int) -> list[tuple[int, int, int, int]]:
    """Along one axis: where what is drawn begins, how long it is, and where what is kept begins and ends."""
    side -= side % ALIGNED_PX
    margin = min(MARGIN_PX, side // 4 // ALIGNED_PX * ALIGNED_PX)
    spans = []
    for kept_from in range(0, length, max(side - 2 * margin, 1)):
        kept_to = min(kept_from + side - 2 * margin, length)
        first = max(kept_from - margin, 0)
        drawn = min(-(-(kept_to + margin - first) // ALIGNED_PX) * ALIGNED_PX, length - first)
        spans.append((first, drawn, kept_from, kept_to))
    return spans
