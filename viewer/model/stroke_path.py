"""The path of a brush stroke, of the depth brush and of the gloss brush."""

from __future__ import annotations

from math import hypot

from iibr_core.scenes.screen_size import ScreenSize

POINT_SPACING = 1 / 6
"""Distance between the points of a stroke, as a share of its radius."""
Place = tuple[float, float]
"""Place (x, y) as shares of the photo's width and height."""


def longer_path(
    points: tuple[Place, ...], place: Place, radius: float, size: ScreenSize, most: int
) -> tuple[Place, ...]:
    """Return a path with one more place; the same path if that is too near, or if it has `most` points already.

    radius: of the brush, as a share of the photo's width. size: of the photo.
    """
    x, y = points[-1]
    step = hypot(place[0] - x, (place[1] - y) * size.height / size.width)
    return points if step < POINT_SPACING * radius or len(points) >= most else (*points, place)
