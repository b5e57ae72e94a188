"""Pictures too large to be drawn at once, cut into parts. No GL."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.scenes.rect import Rect
from iibr_core.scenes.screen_size import ScreenSize

PART_PX = 2048
"""Side of a part, at most, in pixels: its targets take 20 bytes a pixel."""


@dataclass(frozen=True)
class PictureTile:
    """A rectangle of a picture that is drawn at once.

    window: where it is, as a share of the picture. rows, columns: its pixels.
    """

    window: Rect
    rows: slice
    columns: slice

    @property
    def size_px(self) -> ScreenSize:
        """Width and height."""
        return ScreenSize(self.columns.stop - self.columns.start, self.rows.stop - self.rows.start)


def picture_tiles(size_px: ScreenSize, largest_px: int) -> list[PictureTile]:
    """Parts that together are the whole picture, each at most largest_px wide and high. size_px: (width, height)."""
    side = min(PART_PX, largest_px)
    width, height = size_px
    return [
        PictureTile(
            Rect(left / width, top / height, (right - left) / width, (bottom - top) / height),
            slice(top, bottom),
            slice(left, right),
        )
        for top, bottom in _spans(height, side)
        for left, right in _spans(width, side)
    ]


def _spans(length: int, side: int) -> list[tuple[int, int]]:
    return [(first, min(first + side, length)) for first in range(0, length, side)]
