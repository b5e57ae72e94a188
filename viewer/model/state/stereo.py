"""Records of the stereo picture; `viewer.model.stereo` has the verbs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.lenticular import Calibration
from iibr_core.scenes.screen_size import ScreenSize

StereoMode = Literal["sbs", "half-sbs", "top-bottom", "rows", "columns", "checkerboard", "anaglyph", "cross-eyed"]
STEREO_MODES: tuple[StereoMode, ...] = get_args(StereoMode)


@dataclass(frozen=True)
class Monitor:
    """A monitor by name, its place and its size in screen units. width_mm: 0 if it does not state that."""

    name: str
    x: int
    y: int
    width: int
    height: int
    width_mm: int = 0

    @property
    def words(self) -> str:
        """The monitor for people."""
        return f"{self.name}, {self.width} x {self.height} at {self.x}, {self.y}"


@dataclass(frozen=True)
class Stereo:
    """The stereo picture of the open scene.

    monitor: monitor that it fills; None for the window's. eyes: distance of the eyes in view steps, None for a
    comfortable one. screen: disparity that lies in the plane of the screen, px per view step. display: the lenticular
    display that shows it; None for both eyes' pictures.
    """

    is_shown: bool = False
    monitor: Monitor | None = None
    eyes: float | None = None
    screen: float = 0.0
    display: Calibration | None = None

    @property
    def fills_window(self) -> bool:
        """Whether the window itself shows it."""
        return self.is_shown and self.monitor is None


@dataclass(frozen=True)
class Weave:
    """Pictures of one size from several viewpoints, the leftmost first, and how they are woven into one for a screen.

    arrangement: that of both eyes' pictures, or a lenticular display. size_px: of the screen. frame_px: room of each
    picture, which lies in the middle of it, on the screen; on a lenticular display rooms are stretched over the screen.
    """

    eyes: tuple[RenderSettings, ...]
    arrangement: StereoMode | Calibration
    size_px: ScreenSize
    frame_px: ScreenSize
