"""Where things lie in the window: the picture, letterboxed, beside the panel. The one map between the two.

Window units are GLFW's screen coordinates (ImGui's too), y down; a framebuffer pixel may be smaller (HiDPI).
"""

from __future__ import annotations

from dataclasses import dataclass

PANEL_WIDTH = 300.0
MARGIN = 12.0


@dataclass(frozen=True)
class Rect:
    """A rectangle: its upper left corner and its size."""

    x: float
    y: float
    width: float
    height: float

    def contains(self, x: float, y: float) -> bool:
        """Whether the point lies inside."""
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


@dataclass(frozen=True)
class Layout:
    """Rectangles in window units; pixel_ratio: framebuffer pixels per window unit; ui_scale: size of text and widgets.

    picture is None where no picture is open or no room is left for it.
    """

    window: Rect
    panel: Rect
    picture: Rect | None
    pixel_ratio: float = 1.0
    ui_scale: float = 1.0

    @property
    def picture_px(self) -> tuple[int, int, int, int] | None:
        """(x, y, width, height) of the picture in framebuffer pixels, y counted from the top."""
        if self.picture is None:
            return None
        x, y = round(self.picture.x * self.pixel_ratio), round(self.picture.y * self.pixel_ratio)
        width, height = round(self.picture.width * self.pixel_ratio), round(self.picture.height * self.pixel_ratio)
        return x, y, max(width, 1), max(height, 1)


def layout_of(
    window_size: tuple[int, int],
    picture_size: tuple[int, int] | None,
    pixel_ratio: float = 1.0,
    ui_scale: float = 1.0,
) -> Layout:
    """Panel at the right, picture as large as it fits beside it. Sizes are (width, height)."""
    width, height = window_size
    panel_width = min(PANEL_WIDTH * ui_scale, width)
    margin = MARGIN * ui_scale
    room = Rect(margin, margin, width - panel_width - 2 * margin, height - 2 * margin)
    return Layout(
        window=Rect(0, 0, width, height),
        panel=Rect(width - panel_width, 0, panel_width, height),
        picture=letterboxed(room, picture_size) if picture_size else None,
        pixel_ratio=pixel_ratio,
        ui_scale=ui_scale,
    )


def letterboxed(room: Rect, picture_size: tuple[int, int]) -> Rect | None:
    """The largest rectangle of the picture's shape centred in the room; None where there is no room."""
    width, height = picture_size
    scale = min(room.width / width, room.height / height)
    if scale <= 0:
        return None
    x = room.x + (room.width - width * scale) / 2
    y = room.y + (room.height - height * scale) / 2
    return Rect(x, y, width * scale, height * scale)


def pixel_at(picture: Rect, picture_size: tuple[int, int], x: float, y: float) -> tuple[float, float]:
    """Pixel coordinates in the picture (centres at integers) of a window position. picture_size is (width, height)."""
    width, height = picture_size
    return (x - picture.x) / picture.width * width - 0.5, (y - picture.y) / picture.height * height - 0.5
