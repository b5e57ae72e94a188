"""Verbs of the stereo picture; viewpoints, shears and arrangement of its pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from iibr_core.beyond.optics import Optics
from iibr_core.exports.framing import size_in_frame
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.lenticular import Calibration
from iibr_core.scenes.lens_limits import clamp, eye_limits
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from viewer.model.action import Setter, setter
from viewer.model.messages import Notice, notify

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


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


MAX_PARALLAX = 0.03
"""Largest parallax that eyes bear, as a share of the picture's width."""
ROUNDING = 1 + 1e-6
"""Factor by which a parallax may exceed the largest one without a warning."""
MAX_MARGIN = 0.3
"""Largest share of the width that the shear may crop at each side."""
BESIDE: tuple[StereoMode, ...] = ("sbs", "half-sbs", "cross-eyed")
"""Modes with the eyes' pictures side by side."""
HOW_TO_LEAVE = "Stereo picture: Esc or 3 closes it, Tab shows the panel."

# Verbs


def show(state: AppState, is_shown: bool) -> AppState:
    """Show the stereo picture on its monitor, or close it. On the window's monitor, the window shows it."""
    wanted = monitor_of(state)
    monitor = None if wanted in state.monitors[:1] else wanted
    shown = replace(state, stereo=replace(state.stereo, is_shown=is_shown, monitor=monitor))
    if not shown.stereo.fills_window:
        return shown
    shown = replace(shown, hides_panel=None)
    return shown if state.stereo.is_shown else notify(shown, Notice(HOW_TO_LEAVE, is_result=True))


def monitor_of(state: AppState) -> Monitor | None:
    """Return the monitor of the preferences if it is connected, else one beside the window's; None without any."""
    usual = next(iter(state.monitors[1:2] or state.monitors), None)
    return _same(state.preferences.stereo_monitor, state.monitors) or usual


def choose_monitor(state: AppState, monitor: Monitor) -> AppState:
    """Choose the monitor; a stereo picture that is shown moves there."""
    state = replace(state, preferences=replace(state.preferences, stereo_monitor=monitor))
    return show(state, True) if state.stereo.is_shown else state


def set_monitors(state: AppState, monitors: tuple[Monitor, ...]) -> AppState:
    """Note the connected monitors, the window's first. A stereo picture on another monitor that is gone is closed."""
    shown = state.stereo.monitor
    state = replace(state, monitors=monitors)
    if not state.stereo.is_shown or shown is None:
        return state
    if (moved := _same(shown, monitors)) is not None:
        return replace(state, stereo=replace(state.stereo, monitor=moved))
    words = f"The monitor {shown.name} is no longer there, so its stereo picture was closed."
    return notify(show(state, False), Notice(words))


def set_mode(state: AppState, mode: StereoMode) -> AppState:
    """Arrange the pictures of both eyes in this way."""
    preferences = replace(state.preferences, stereo_mode=mode)
    return replace(state, preferences=preferences, stereo=replace(state.stereo, display=None))


def show_on(state: AppState, display: Calibration, place: tuple[int, int] | None = None) -> AppState:
    """Show the pictures of a lenticular display, on the monitor at a place (x, y), else on one of its size."""
    at_place = [each for each in state.monitors if (each.x, each.y) == place]
    of_size = [each for each in state.monitors if (each.height, each.width) == display.screen]
    state = replace(state, stereo=replace(state.stereo, display=display))
    state = choose_monitor(state, (at_place + of_size)[0]) if at_place + of_size else state
    return show(state, True)


def swap_eyes(state: AppState) -> AppState:
    """Give each eye the picture of the other."""
    return replace(state, preferences=replace(state.preferences, swaps_eyes=not state.preferences.swaps_eyes))


set_eyes: Setter[float] = setter("stereo.eyes", (0.0, math.inf))
"""Set the distance of the eyes, in view steps."""
set_screen: Setter[float] = setter("stereo.screen")
"""Set the disparity that lies in the plane of the screen."""


def _same(monitor: Monitor | None, among: tuple[Monitor, ...]) -> Monitor | None:
    """Return the monitor if it is connected, else one of its name."""
    named = [other for other in among if monitor is not None and other.name == monitor.name]
    return monitor if monitor in among else next(iter(named), None)


# Numbers


def eye_distance_limit(scene: Scene) -> float:
    """Return the largest distance of the eyes in view steps: from the first column of views to the last."""
    low, high = eye_limits(scene.grid.columns)
    return high - low


def eye_distance(scene: Scene, stereo: Stereo) -> float:
    """Return the distance of the eyes in view steps: the chosen one, else the largest that eyes bear, or for a display
    with tens of pictures that from the first to the last.
    """
    limit = eye_distance_limit(scene)
    cropped = MAX_PARALLAX * abs(screen_plane(scene, stereo)) / scene.width  # the shear's crop enlarges the parallax
    usual = limit if stereo.display else MAX_PARALLAX / (parallax_of_a_view(scene, stereo) + cropped)
    return clamp(usual if stereo.eyes is None else stereo.eyes, 0.0, limit)


def parallax_of_a_view(scene: Scene, stereo: Stereo) -> float:
    """Return the largest parallax of eyes one view step apart, as a share of the picture's width, above 0."""
    plane = screen_plane(scene, stereo)
    return max(*(abs(edge - plane) for edge in scene.disparity_range_px), 1e-6) / scene.width


def screen_plane(scene: Scene, stereo: Stereo) -> float:
    """Return the disparity in the plane of the screen: the chosen one, within the scene."""
    return clamp(stereo.screen, *scene.disparity_range_px)


def warning(scene: Scene, stereo: Stereo) -> str:
    """Return words about parallax that eyes do not bear, or about a monitor that does not fit, "" without."""
    if (display := stereo.display) is not None:
        monitor = stereo.monitor
        if monitor is None or (monitor.height, monitor.width) == display.screen:
            return ""
        return f"The calibration is that of a screen of {display.screen}, not of {monitor.words}."
    moved = eye_distance(scene, stereo) / scene.width / eyes_at(scene, Optics(), stereo)[0].part.width
    far, near = ((edge - screen_plane(scene, stereo)) * moved for edge in scene.disparity_range_px)
    worst, place, remedy = max((near, "before", "nearer"), (-far, "behind", "farther"))
    if worst <= MAX_PARALLAX * ROUNDING:
        return ""
    words = f"Parallax {place} the screen is {100 * worst:.1f} % of the width, and eyes bear 3 %"
    return f"{words}: reduce the eye distance, or move the screen {remedy}."


def eyes_at(scene: Scene, optics: Optics, stereo: Stereo, count: int = 2) -> tuple[RenderSettings, ...]:
    """Return `count` pictures of the views' size, the leftmost first, about the viewpoint if the views allow.

    They are sheared, so that the plane of the screen stays in place, and all are cropped by the largest shear.
    """
    span, (first, last) = eye_distance(scene, stereo), eye_limits(scene.grid.columns)
    middle = clamp(optics.eye.s, first + span / 2, last - span / 2)
    moved = clamp(screen_plane(scene, stereo) * span / scene.width, -2 * MAX_MARGIN, 2 * MAX_MARGIN)
    margin = abs(moved) / 2
    return tuple(
        RenderSettings(
            replace(optics, eye=ViewOffset(optics.eye.t, middle + span * aside)),
            ScreenSize(scene.width, scene.height),
            Rect(margin - moved * aside, 0.0, 1 - 2 * margin, 1.0),
        )
        for aside in map(float, np.linspace(-0.5, 0.5, count))
    )


def weave_of(state: AppState, scene: Scene, size_px: ScreenSize) -> Weave:
    """Return the pictures of both eyes or of a lenticular display, and their arrangement on a screen of this size."""
    mode, display = state.preferences.stereo_mode, state.stereo.display
    if display is not None:
        quilt = display.quilt
        count, frame, aspect = quilt.views, ScreenSize(*quilt.tile[::-1]), quilt.aspect
    else:
        across, down = 1 + (mode in BESIDE), 1 + (mode == "top-bottom")
        count, frame = 2, ScreenSize(max(size_px.width // across, 1), max(size_px.height // down, 1))
        aspect = frame.width / frame.height if mode in ("sbs", "cross-eyed") else size_px.width / size_px.height
    eyes = eyes_at(scene, state.shown_optics, state.stereo, count)
    picture_px = size_in_frame(scene, frame, eyes[0].part, aspect)
    is_swapped = display is None and state.preferences.swaps_eyes != (mode == "cross-eyed")
    eyes = tuple(replace(eye, size_px=picture_px) for eye in (eyes[::-1] if is_swapped else eyes))
    return Weave(eyes, display or mode, size_px, frame)


def place_in_photo(weave: Weave, x_px: float, y_px: float) -> tuple[float, float]:
    """Return the place in the middle viewpoint's picture, as shares of its size, under a pixel of the woven screen."""
    (width, height), frame, part = weave.eyes[0].size_px, weave.frame_px, weave.eyes[0].part
    if isinstance(weave.arrangement, Calibration):
        x_px, y_px = (at * room / size for at, room, size in zip((x_px, y_px), frame, weave.size_px))
    across = (x_px % frame.width - (frame.width - width) // 2) / width
    down = (y_px % frame.height - (frame.height - height) // 2) / height
    return 0.5 + part.width * (clamp(across, 0.0, 1.0) - 0.5), clamp(down, 0.0, 1.0)
