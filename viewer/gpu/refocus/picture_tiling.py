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

    size_px: (width, height) of what is drawn. window: where that is, as a share of the picture. kept, kept_of_drawn:
    rows and columns in the picture, and in what is drawn.
    """

    size_px: ScreenSize
    window: Rect
    kept: tuple[slice, slice]
    kept_of_drawn: tuple[slice, slice]


def picture_tiles(size_px: ScreenSize, largest_px: int) -> list[PictureTile]:
    """Parts that together are kept as the whole picture, each at most largest_px wide and high.

    size_px: (width, height). A picture that can be drawn at once is one part, without margins.
    """
    side = min(PART_PX, largest_px)
    if max(size_px) <= side:
        whole = slice(0, size_px[1]), slice(0, size_px[0])
        return [PictureTile(size_px, WHOLE, whole, whole)]
    (width, height), columns, rows = size_px, _spans(size_px[0], side), _spans(size_px[1], side)
    return [
        PictureTile(
            ScreenSize(across, down),
            Rect(x / width, y / height, across / width, down / height),
            (kept_rows, kept_columns),
            (_moved(kept_rows, -y), _moved(kept_columns, -x)),
        )
        for (y, down, kept_rows), (x, across, kept_columns) in product(rows, columns)
    ]


def _spans(length: int, side: int) -> list[tuple[int, int, slice]]:
    """Along one axis: where what is drawn begins, how long it is, and what is kept."""
    side -= side % ALIGNED_PX
    margin = min(MARGIN_PX, side // 4 // ALIGNED_PX * ALIGNED_PX)
    spans = []
    for kept_from in range(0, length, max(side - 2 * margin, 1)):
        kept_to = min(kept_from + side - 2 * margin, length)
        first = max(kept_from - margin, 0)
        drawn = min(-(-(kept_to + margin - first) // ALIGNED_PX) * ALIGNED_PX, length - first)
        spans.append((first, drawn, slice(kept_from, kept_to)))
    return spans


def _moved(span: slice, steps: int) -> slice:
    return slice(span.start + steps, span.stop + steps)
