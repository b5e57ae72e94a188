"""Records of the stereo picture; `viewer.model.stereo` has the verbs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from iibr_core.beyond.optics import Optics
from iibr_core.formats.lenticular import Calibration
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.screen_size import ScreenSize

StereoMode = Literal["sbs", "half-sbs", "top-bottom", "rows", "columns", "checkerboard", "anaglyph", "cross-eyed"]
STEREO_MODES: tuple[StereoMode, ...] = get_args(StereoMode)


@dataclass(frozen=True)
class Monitor:
    """A monitor by name, its place and its size in screen units."""

    name: str
    x: int
    y: int
    width: int
    height: int

    @property
    def words(self) -> str:
        """The monitor for people."""
        return f"{self.name}, {self.width} x {self.height} at {self.x}, {self.y}"


@dataclass(frozen=True)
class StereoChoice:
    """Preferences of the stereo picture. monitor: chosen last; None for the window's own."""

    mode: StereoMode = "half-sbs"
    is_swapped: bool = False
    monitor: Monitor | None = None


@dataclass(frozen=True)
class Stereo:
    """The stereo picture of the open scene.

    monitor: monitor that it fills; None for the window itself. eyes: distance of the eyes in view steps, None for a
    comfortable one. screen: disparity that lies in the plane of the screen, px per view step. before: whether the
    window was full screen, and `hides_panel`, before it showed the stereo picture. display: the lenticular
    display that shows it; None for both eyes' pictures.
    """

    is_shown: bool = False
    monitor: Monitor | None = None
    eyes: float | None = None
    screen: float = 0.0
    before: tuple[bool, bool | None] = (False, None)
    display: Calibration | None = None


@dataclass(frozen=True)
class Eye:
    """The optics of a picture, and the part of it that is shown."""

    optics: Optics
    part: Rect


@dataclass(frozen=True)
class Weave:
    """Pictures from several viewpoints, the leftmost first, and how they are woven into one for a screen.

    mode: switch of the shader. size_px: of the screen. frame_px: room of each picture on the screen. picture_px: each
    picture, which lies in the middle of its room. display: lenticular display, whose rooms are stretched over the whole
    screen; None for both eyes' pictures.
    """

    eyes: tuple[Eye, ...]
    mode: StereoMode
    size_px: ScreenSize
    frame_px: ScreenSize
    picture_px: ScreenSize
    is_swapped: bool = False
    display: Calibration | None = None
