"""Rectangles, of the window or as shares of a picture; y down."""

from __future__ import annotations

from typing import NamedTuple


class Rect(NamedTuple):
    """A rectangle: its upper left corner and its size."""

    x: float
    y: float
    width: float
    height: float

    def contains(self, x: float, y: float) -> bool:
        """Whether the point lies inside."""
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height

    def within(self, other: Rect) -> Rect:
        """Return the part that lies in another rectangle."""
        x, y = max(self.x, other.x), max(self.y, other.y)
        far_x, far_y = (
            min(self.x + self.width, other.x + other.width),
            min(self.y + self.height, other.y + other.height),
        )
        return Rect(x, y, max(far_x - x, 0.0), max(far_y - y, 0.0))

    def part(self, inner: Rect) -> Rect:
        """A part of it. inner: as shares of it."""
        left, top = self.x + inner.x * self.width, self.y + inner.y * self.height
        return Rect(left, top, inner.width * self.width, inner.height * self.height)


WHOLE = Rect(0.0, 0.0, 1.0, 1.0)
"""All of the picture, as a share of it."""
