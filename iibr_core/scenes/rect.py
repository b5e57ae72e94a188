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
        """Return whether the point lies inside."""
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height

    def within(self, other: Rect) -> Rect:
        """Return the part that lies in another rectangle."""
        x, y = max(self.x, other.x), max(self.y, other.y)
        width = min(self.x + self.width, other.x + other.width) - x
        height = min(self.y + self.height, other.y + other.height) - y
        return Rect(x, y, max(width, 0.0), max(height, 0.0))

    def part(self, inner: Rect) -> Rect:
        """Return a part. inner: the part, as shares of this rectangle."""
        left, top = self.x + inner.x * self.width, self.y + inner.y * self.height
        return Rect(left, top, inner.width * self.width, inner.height * self.height)


WHOLE = Rect(0.0, 0.0, 1.0, 1.0)
"""The whole picture, as shares."""
