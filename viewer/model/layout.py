"""Rectangles of the window: the picture, letterboxed, beside the panel; the one map between window and picture.

Window units are GLFW's screen coordinates (ImGui's too), y down; a framebuffer pixel may be smaller (HiDPI).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize


@dataclass(frozen=True)
class Zoom:
    """A visible part of the picture.

    scale: pixels of the screen per pixel of the photo at its own size. centre: the point of the picture, (x, y) from 0
    to 1, that lies in the middle of the available space, as far as the picture fills that.
    """

    scale: float
    centre: tuple[float, float] = (0.5, 0.5)


BACKGROUND = 0.07, 0.07, 0.08, 1.0
"""Colour behind the picture in the dark theme, 0..1."""
PANEL_WIDTH = 300.0
MARGIN = 12.0
NARROW_WIDTH = 720.0
"""Width of the window, at usual size, below which the panel folds away."""


class PixelRect(NamedTuple):
    """A part of the framebuffer; y down."""

    x: int
    y: int
    width: int
    height: int

    @property
    def size(self) -> ScreenSize:
        """Width and height."""
        return ScreenSize(self.width, self.height)


MINIMAP_SIDE = 150.0
"""Longer side of the minimap, in window units at usual size."""

MAX_ZOOM = 4.0
"""Largest zoom: this many times the photo's own size, or what fits where that is larger."""
ZOOM_NOTCH = 1.25
"""Factor of the zoom for one notch of the wheel."""

NEAR_FIT = 1.02
"""Factor of the fitting size within which the zoom snaps to fit."""

STRIP_UNITS_PER_VIEW = 9.0
MIN_STRIP, MAX_STRIP = 45.0, 130.0
"""Limits of the thickness of EPI strips at usual size."""

STRIP_GAP = 6.0
STATUS_HEIGHT = 26.0
FILMSTRIP_HEIGHT = 84.0


@dataclass(frozen=True)
class Beside:
    """Things beside the picture. epi_views: numbers of views in the EPIs (down, across), None without EPIs."""

    epi_views: tuple[int, int] | None = None
    has_status: bool = False
    has_filmstrip: bool = False


NOTHING_BESIDE = Beside()


@dataclass(frozen=True)
class Layout:
    """Rectangles in window units; pixel_ratio: framebuffer pixels per window unit; ui_scale: size of text and widgets.

    picture: the whole picture, None where none is open or no room is left. room: room for the picture, None: as large
    as the picture. is_zoomed: whether the picture has another size than fits, and is cut to its room. scale: pixels of
    the screen for one pixel of the photo; fit: the scale at which the picture fits. strip_across, strip_down: the EPIs,
    as wide and as high as the seen part of the picture; status: a line below; filmstrip: a row of thumbnails at the
    bottom; each None where it is not shown.
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
    room: Rect | None = None
    is_zoomed: bool = False
    scale: float = 1.0
    fit: float = 1.0

    @property
    def frame(self) -> Rect | None:
        """The seen part of the picture."""
        if self.picture is None or self.room is None or not self.is_zoomed:
            return self.picture
        return self.picture.within(self.room)

    @property
    def frame_px(self) -> PixelRect | None:
        """The seen part in framebuffer pixels, y counted from the top."""
        return None if self.frame is None else self.in_pixels(self.frame)

    @property
    def part(self) -> Rect:
        """The seen part as a share of the picture."""
        if self.picture is None or self.frame_px is None or not self.is_zoomed:
            return WHOLE
        x, y, width, height = (value / self.pixel_ratio for value in self.frame_px)
        picture = self.picture
        left, top = (x - picture.x) / picture.width, (y - picture.y) / picture.height
        return Rect(left, top, width / picture.width, height / picture.height)

    @property
    def minimap(self) -> Rect | None:
        """The minimap in the lower right corner; None where the whole picture is seen, or without room."""
        frame = self.frame
        if self.picture is None or frame is None or frame == self.picture:
            return None
        share = MINIMAP_SIDE * self.ui_scale / max(self.picture.width, self.picture.height)
        width, height, gap = share * self.picture.width, share * self.picture.height, STRIP_GAP * self.ui_scale
        if 2 * width > frame.width or 2 * height > frame.height:
            return None
        return Rect(frame.x + frame.width - width - gap, frame.y + frame.height - height - gap, width, height)

    def zoomed(self, notches: float, x: float, y: float) -> Zoom | None:
        """Return the zoom after notches of the wheel about (x, y); None: the picture fits."""
        low, high = min(self.fit, 1.0), MAX_ZOOM * max(self.fit, 1.0)
        scale = min(max(self.scale * ZOOM_NOTCH**notches, low), high)
        passes_fit = (scale - self.fit) * (self.scale - self.fit) < 0
        if self.picture is None or passes_fit or 1 / NEAR_FIT < scale / self.fit < NEAR_FIT:
            return None
        larger = scale / self.scale
        return self._zoom_to(scale, x + (self.picture.x - x) * larger, y + (self.picture.y - y) * larger, larger)

    def pulled(self, step_x: float, step_y: float) -> Zoom | None:
        """Return the zoom after the picture was pulled; None where it fits."""
        if self.picture is None or not self.is_zoomed:
            return None
        return self._zoom_to(self.scale, self.picture.x + step_x, self.picture.y + step_y, 1.0)

    def shown_on_minimap(self, x: float, y: float) -> Zoom | None:
        """Return the zoom that centres a place (x, y) on the minimap; None without a minimap."""
        at = self.minimap
        if at is None:
            return None
        return Zoom(self.scale, ((x - at.x) / at.width, (y - at.y) / at.height))

    def _zoom_to(self, scale: float, left: float, top: float, larger: float) -> Zoom:
        """Return the zoom with the picture's corner at (left, top), enlarged by a factor."""
        assert self.picture is not None
        room = self.room or self.picture
        x = (room.x + room.width / 2 - left) / (self.picture.width * larger)
        y = (room.y + room.height / 2 - top) / (self.picture.height * larger)
        return Zoom(scale, (x, y))

    def in_pixels(self, rect: Rect) -> PixelRect:
        """Return a rectangle in framebuffer pixels, at least one pixel wide and high."""
        x, y = round(rect.x * self.pixel_ratio), round(rect.y * self.pixel_ratio)
        width, height = round(rect.width * self.pixel_ratio), round(rect.height * self.pixel_ratio)
        return PixelRect(x, y, max(width, 1), max(height, 1))


def whole_pixels(rect: Rect) -> PixelRect:
    """Return a rectangle in pixels, rounded so that neighbours still touch, at least one pixel wide and high."""
    left, top = round(rect.x), round(rect.y)
    return PixelRect(left, top, max(round(rect.x + rect.width) - left, 1), max(round(rect.y + rect.height) - top, 1))


def is_narrow(window_size: ScreenSize, ui_scale: float) -> bool:
    """Return whether the panel folds away. ui_scale: of the display; larger text alone folds nothing away."""
    return window_size[0] < NARROW_WIDTH * ui_scale


def layout_of(
    window_size: ScreenSize,
    picture_size: ScreenSize | None,
    pixel_ratio: float = 1.0,
    ui_scale: float = 1.0,
    beside: Beside = NOTHING_BESIDE,
    has_panel: bool = True,
    zoom: Zoom | None = None,
    own_width: int | None = None,
) -> Layout:
    """Return the layout: the panel at the right, the picture as large as fits in the rest. Sizes are (width, height).

    zoom: seen part of the picture. own_width: width of the photo, if the picture is smaller.
    """
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
    fit = scale = picture.width * pixel_ratio / (own_width or picture_size[0]) if picture and picture_size else 1.0
    is_zoomed = zoom is not None and picture is not None
    if zoom is not None and picture is not None:
        scale = zoom.scale
        picture = _zoomed(picture, zoom, fit, room, pixel_ratio)
    layout = Layout(
        window=Rect(0, 0, width, window_height),
        panel=Rect(width - panel_width, 0, panel_width, window_height),
        picture=picture,
        pixel_ratio=pixel_ratio,
        ui_scale=ui_scale,
        filmstrip=Rect(0, height, width - panel_width, filmstrip_height) if filmstrip_height else None,
        room=room,
        is_zoomed=is_zoomed,
        scale=scale,
        fit=fit,
    )
    frame = layout.frame
    if frame is None:
        return layout
    below = frame.y + frame.height
    return replace(
        layout,
        strip_across=Rect(frame.x, below + gap, frame.width, across) if across else None,
        strip_down=Rect(frame.x + frame.width + gap, frame.y, down, frame.height) if down else None,
        status=Rect(margin, height - margin - status_height, room.width, status_height) if status_height else None,
    )


def _thickness(views: int, ui_scale: float) -> float:
    """Return the thickness of an EPI strip; 0 without views."""
    return min(max(views * STRIP_UNITS_PER_VIEW, MIN_STRIP), MAX_STRIP) * ui_scale if views else 0.0


def letterbox(room: Rect, picture_size: ScreenSize) -> Rect | None:
    """Return the largest rectangle of the picture's shape, centred in the room; None where there is no room."""
    width, height = picture_size
    scale = min(room.width / width, room.height / height)
    if scale <= 0:
        return None
    x = room.x + (room.width - width * scale) / 2
    y = room.y + (room.height - height * scale) / 2
    return Rect(x, y, width * scale, height * scale)


def _zoomed(fitting: Rect, zoom: Zoom, fit: float, room: Rect, pixel_ratio: float) -> Rect:
    """Return the rectangle of the zoomed picture on whole pixels; it is centred unless it fills the room."""
    larger = zoom.scale / fit
    width, height = fitting.width * larger, fitting.height * larger

    def place(low: float, size: float, length: float, centre: float) -> float:
        at = low + size / 2 - centre * length
        at = min(max(at, low + size - length), low) if length > size else low + (size - length) / 2
        return round(at * pixel_ratio) / pixel_ratio

    x = place(room.x, room.width, width, zoom.centre[0])
    return Rect(x, place(room.y, room.height, height, zoom.centre[1]), width, height)


def pixel_at(picture: Rect, picture_size: ScreenSize, x: float, y: float) -> tuple[float, float]:
    """Return the pixel (x, y) of the picture, centres at integers, at a window position."""
    width, height = picture_size
    return (x - picture.x) / picture.width * width - 0.5, (y - picture.y) / picture.height * height - 0.5
