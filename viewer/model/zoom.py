"""Which part of the picture is seen, and how large: a record of the state, and the action that changes it."""

from __future__ import annotations

from dataclasses import dataclass

MOST_ZOOM = 4.0
"""Times the photo's own size, or what fits where that is larger."""

LEAST_ZOOM = 1e-3


@dataclass(frozen=True)
class Zoom:
    """A part of the picture. scale: pixels of the screen per pixel of the photo's own size. centre: what lies in the
    middle of the room for it, (x, y) from 0 to 1 across the picture; as near to that as the picture fills the room.
    """

    scale: float
    centre: tuple[float, float] = (0.5, 0.5)


@dataclass(frozen=True)
class SetZoom:
    """Show this part; None: the whole picture, as large as it fits."""

    zoom: Zoom | None
