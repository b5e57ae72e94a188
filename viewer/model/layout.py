"""Where things lie in the window: the picture, letterboxed, beside the panel. The one map between the two.

Window units are GLFW's screen coordinates (ImGui's too), y down; a framebuffer pixel may be smaller (HiDPI).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

BACKGROUND = 0.07, 0.07, 0.08, 1.0
"""Behind the picture, where the theme is dark."""
PANEL_WIDTH = 300.0
MARGIN = 12.0


class ScreenSize(NamedTuple):
    """Width and height in pixels: the order of GL, GLFW and ImGui. Images have an `ImageSize`; no type checker lets
    one pass for the other.
    """

    width: int
    height: int


class PixelRect(NamedTuple):
    """A part of the framebuffer; y down."""

    x: int
    y: int
    width: int
    height: int

    @property
    def size(self) -> ScreenSize:
        """Of the part."""
        return ScreenSize(self.width, self.height)


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


STRIP_UNITS_PER_VIEW = 9.0
LEAST_STRIP, MOST_STRIP = 45.0, 130.0
"""EPI strips are this thick at usual size, however few or many views there are."""

STRIP_GAP = 6.0
STATUS_HEIGHT = 26.0
FILMSTRIP_HEIGHT = 84.0


@dataclass(frozen=True)
class Beside:
    """What takes room beside the picture. epi_views: numbers of views in the EPIs (down, across), None without them."""

    epi_views: tuple[int, int] | None = None
    has_status: bool = False
    has_filmstrip: bool = False


NOTHING_BESIDE = Beside()


@dataclass(frozen=True)
class Layout:
    """Rectangles in window units; pixel_ratio: framebuffer pixels per window unit; ui_scale: size of text and widgets.

    picture is None where no picture is open or no room is left for it. strip_across, strip_down: the EPIs, as wide and
    as high as the picture; status: a line below; filmstrip: a row of small pictures at the bottom. None where they are
    not shown.
    """

    window: Rect
    panel: Rect
    picture: Rect | None
    pixel_ratio: float = 1.0
    ui_scale: float = 1.0
    strip_across: Rect | None = None
    strip_down: Rect | None = None
    status: Rect | None = None
    filmstrip: Rect | None = None

    @property
    def picture_px(self) -> PixelRect | None:
        """The picture in framebuffer pixels, y counted from the top."""
        return None if self.picture is None else self.in_pixels(self.picture)

    def in_pixels(self, rect: Rect) -> PixelRect:
        """A rectangle in framebuffer pixels, at least one each way."""
        x, y = round(rect.x * self.pixel_ratio), round(rect.y * self.pixel_ratio)
        width, height = round(rect.width * self.pixel_ratio), round(rect.height * self.pixel_ratio)
        return PixelRect(x, y, max(width, 1), max(height, 1))


def layout_of(
    window_size: ScreenSize,
    picture_size: ScreenSize | None,
    pixel_ratio: float = 1.0,
    ui_scale: float = 1.0,
    beside: Beside = NOTHING_BESIDE,
    has_panel: bool = True,
) -> Layout:
    """Panel at the right, picture as large as it fits beside it and what is beside it. Sizes are (width, height)."""
    width, window_height = window_size
    filmstrip_height = FILMSTRIP_HEIGHT * ui_scale if beside.has_filmstrip else 0.0
    height = max(window_height - filmstrip_height, 0)
    panel_width = min(PANEL_WIDTH * ui_scale, width) if has_panel else 0.0
    margin, gap = MARGIN * ui_scale, STRIP_GAP * ui_scale
    down, across = (_thickness(views, ui_scale) for views in beside.epi_views or (0, 0))
    status_height = STATUS_HEIGHT * ui_scale if beside.has_status else 0.0
    room_height = height - 2 * margin - (across + gap if across else 0) - status_height
    room = Rect(margin, margin, width - panel_width - 2 * margin - (down + gap if down else 0), room_height)
    picture = letterbox(room, picture_size) if picture_size else None
    layout = Layout(
        window=Rect(0, 0, width, window_height),
        panel=Rect(width - panel_width, 0, panel_width, window_height),
        picture=picture,
        pixel_ratio=pixel_ratio,
        ui_scale=ui_scale,
        filmstrip=Rect(0, height, width - panel_width, filmstrip_height) if filmstrip_height else None,
    )
    if picture is None:
        return layout
    below = picture.y + picture.height
    return replace(
        layout,
        strip_across=Rect(picture.x, below + gap, picture.width, across) if across else None,
        strip_down=Rect(picture.x + picture.width + gap, picture.y, down, picture.height) if down else None,
        status=Rect(margin, height - margin - status_height, room.width, status_height) if status_height else None,
    )


def _thickness(views: int, ui_scale: float) -> float:
    """Of an EPI strip: every view several pixels, within limits; none without views."""
    return min(max(views * STRIP_UNITS_PER_VIEW, LEAST_STRIP), MOST_STRIP) * ui_scale if views else 0.0


def letterbox(room: Rect, picture_size: ScreenSize) -> Rect | None:
    """The largest rectangle of the picture's shape centred in the room; None where there is no room."""
    width, height = picture_size
    scale = min(room.width / width, room.height / height)
    if scale <= 0:
        return None
    x = room.x + (room.width - width * scale) / 2
    y = room.y + (room.height - height * scale) / 2
    return Rect(x, y, width * scale, height * scale)


def pixel_at(picture: Rect, picture_size: ScreenSize, x: float, y: float) -> tuple[float, float]:
    """Pixel coordinates in the picture (centres at integers) of a window position. picture_size is (width, height)."""
    width, height = picture_size
    return (x - picture.x) / picture.width * width - 0.5, (y - picture.y) / picture.height * height - 0.5
