"""The GLFW window. Only this module, `stereo_screen` and `viewer.gpu` call GLFW.

The bundle is imported before glfw on purpose: it brings the GLFW library that both must share.
"""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

# isort: off
import imgui_bundle  # noqa: F401
import glfw

# isort: on
import numpy as np
from PIL import Image

from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.model.stereo import Monitor

WINDOW_SIZE = (1280, 800)
SMALLEST_SIZE = (200, 150)
STEP_ASIDE = 32
"""Distance of a second window from the first, across and down, in screen units."""
ICON_SIZES_PX = (16, 32, 48)


class Window:
    """A window with an OpenGL 3.3 core context.

    handle: GLFW's window. size: in window units; framebuffer_size: in pixels, (0, 0) while minimised; both are updated
    by `poll`. damages: number of redraws that the system asked for. held_at: modifiers (Ctrl or Super, Shift) that were
    held when a key was pressed last, by the letter on the key.
    """

    def __init__(self, title: str, place: tuple[int, int, int, int] | None = None, is_maximized: bool = False) -> None:
        """Open the window, at place (x, y, width, height) if that is on a screen.

        Raises InputError without a display or without OpenGL 3.3.
        """
        with warnings.catch_warnings(record=True) as reasons:
            warnings.simplefilter("always")
            self.handle: Any = _open(title, place, is_maximized)
        if not self.handle:
            reason = "; ".join(_words_of(warning.message) for warning in reasons) or "GLFW gives no reason"
            glfw.terminate()
            raise InputError(f"no window can be opened ({reason}): `iibr screenshot` works without a display")
        if place is not None and not is_maximized and _is_on_a_screen(place):
            glfw.set_window_pos(self.handle, place[0], place[1])
        self.damages = 0
        self._monitors: tuple[Monitor, ...] = ()
        self._monitors_of: tuple[object, ...] = ()
        self._place_before = (0, 0, *WINDOW_SIZE)
        self._dropped: list[str] = []
        self.held_at: dict[str, tuple[bool, bool]] = {}
        # Elsewhere none can be set.
        self._needs_icon = glfw.get_platform() in (glfw.PLATFORM_X11, glfw.PLATFORM_WIN32)
        glfw.set_key_callback(self.handle, self._on_key)  # ImGui's own callback calls it
        glfw.set_drop_callback(self.handle, self.on_drop)  # type: ignore[arg-type]  # the stub is wrong
        glfw.set_window_refresh_callback(self.handle, self._on_damage)
        glfw.make_context_current(self.handle)
        glfw.swap_interval(1)
        self._take_sizes()

    @property
    def place(self) -> tuple[int, int, int, int] | None:
        """Place (x, y, width, height) in screen units; None while the window is maximized."""
        if glfw.get_window_attrib(self.handle, glfw.MAXIMIZED):
            return None
        x, y = glfw.get_window_pos(self.handle)
        return (x, y, *self.size)

    def step_aside(self) -> None:
        """Move a little, so that the window does not hide another one that opened at the same place."""
        if not glfw.get_window_attrib(self.handle, glfw.MAXIMIZED):
            x, y = glfw.get_window_pos(self.handle)
            glfw.set_window_pos(self.handle, x + STEP_ASIDE, y + STEP_ASIDE)

    @property
    def is_fullscreen(self) -> bool:
        """Whether the window fills the screen without frame and title."""
        return bool(glfw.get_window_monitor(self.handle))

    def set_fullscreen(self, is_full: bool) -> None:
        """Fill the screen that most of the window lies on, or return to the place before."""
        if is_full == self.is_fullscreen:
            return
        if not is_full:
            no_monitor: Any = None
            glfw.set_window_monitor(self.handle, no_monitor, *self._place_before, 0)
            return
        x, y = glfw.get_window_pos(self.handle)
        self._place_before = (x, y, *self.size)
        monitor = max(glfw.get_monitors(), key=lambda monitor: _overlap(self._place_before, monitor), default=None)
        if monitor is not None:
            mode = glfw.get_video_mode(monitor)
            glfw.set_window_monitor(self.handle, monitor, 0, 0, *mode.size, mode.refresh_rate)

    @property
    def monitors(self) -> tuple[Monitor, ...]:
        """The connected monitors, that with most of the window first. Looked up after changes only: it takes time."""
        connected, place = glfw.get_monitors(), (*glfw.get_window_pos(self.handle), *self.size)
        monitors_of = place, *(ctypes.cast(monitor, ctypes.c_void_p).value for monitor in connected)
        if monitors_of != self._monitors_of:
            by_overlap = sorted(connected, key=lambda monitor: -_overlap(place, monitor))
            self._monitors_of, self._monitors = monitors_of, tuple(map(monitor_record, by_overlap))
        return self._monitors

    @property
    def is_hidden(self) -> bool:
        """Whether the window is minimised."""
        return bool(glfw.get_window_attrib(self.handle, glfw.ICONIFIED))

    @property
    def pixel_ratio(self) -> float:
        """Framebuffer pixels per window unit."""
        return self.framebuffer_size[0] / max(self.size[0], 1) or 1.0

    @property
    def ui_scale(self) -> float:
        """Scale of text and widgets, in window units, that this display asks for."""
        scale: float = glfw.get_window_content_scale(self.handle)[0]
        return max(scale / self.pixel_ratio, 1.0)

    def take_closing(self) -> bool:
        """Return whether the user asked to close the window since the last call."""
        wanted = bool(glfw.window_should_close(self.handle))
        glfw.set_window_should_close(self.handle, False)
        return wanted

    def set_title(self, title: str) -> None:
        """Write this in the title bar."""
        glfw.set_window_title(self.handle, title)

    def show_icon(self) -> None:
        """Show the program's icon in the title bar and the list of windows; a second call does nothing.

        The first takes some 50 ms, most of it for loading Pillow's reader of PNG.
        """
        if self._needs_icon:
            folder = resource_folder("assets") / "icon"
            icons: list[Any] = [
                (size, size, np.asarray(Image.open(folder / f"iibr-{size}.png", formats=["PNG"])).tolist())
                for size in ICON_SIZES_PX
            ]
            glfw.set_window_icon(self.handle, len(icons), icons)
            self._needs_icon = False

    def poll(self, wait_s: float) -> None:
        """Handle events; without any, wait for one at most this long."""
        with self._keeping_names():
            if wait_s > 0:
                glfw.wait_events_timeout(wait_s)
            else:
                glfw.poll_events()
        self._take_sizes()

    def wake(self) -> None:
        """End the wait of `poll`; may be called in any thread."""
        with self._keeping_names():
            glfw.post_empty_event()

    @contextmanager
    def _keeping_names(self) -> Iterator[None]:
        """Take a dropped name that is not UTF-8, of which any call of GLFW may raise; it is reported as not found."""
        try:
            yield
        except UnicodeDecodeError as error:
            self._dropped.append(error.object.decode(errors="replace"))

    def _take_sizes(self) -> None:
        self.size = ScreenSize(*glfw.get_window_size(self.handle))
        self.framebuffer_size = ScreenSize(*glfw.get_framebuffer_size(self.handle))

    def _on_key(self, _: Any, key: int, scancode: int, action: int, modifiers: int) -> None:
        name = glfw.get_key_name(key, scancode) if action == glfw.PRESS else None
        if name:
            is_ctrl, is_shift = modifiers & (glfw.MOD_CONTROL | glfw.MOD_SUPER), modifiers & glfw.MOD_SHIFT
            self.held_at[name.lower()] = bool(is_ctrl), bool(is_shift)

    def on_drop(self, _: Any, paths: Any) -> None:
        """Take the paths of dropped files. GLFW calls this."""
        self._dropped.extend(paths)

    def take_dropped(self) -> list[str]:
        """Return the paths of the files dropped on the window since the last call."""
        dropped, self._dropped = self._dropped, []
        return dropped

    def clipboard_text(self) -> str:
        """Return the text in the system's clipboard, "" without."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it holds something else, or nothing
            text: Any = glfw.get_clipboard_string(self.handle)
        return (text or b"").decode(errors="replace")

    def show_frame(self) -> None:
        """Show what was drawn."""
        glfw.swap_buffers(self.handle)

    def wait_for_screen(self, is_wanted: bool) -> None:
        """Let `show_frame` wait for the screen, or not; the window's context becomes current."""
        glfw.make_context_current(self.handle)
        glfw.swap_interval(int(is_wanted))

    def ask_for_attention(self) -> None:
        """Bring the window to the front, as far as the system allows that."""
        if self.is_hidden:
            glfw.restore_window(self.handle)
        glfw.focus_window(self.handle)
        glfw.request_window_attention(self.handle)

    def hide(self) -> None:
        """Hide the window."""
        glfw.hide_window(self.handle)

    def close(self) -> None:
        """Close the window and GLFW."""
        glfw.destroy_window(self.handle)
        glfw.terminate()
        self.handle = None

    def _on_damage(self, _: Any) -> None:
        self.damages += 1


def _words_of(warning: Warning | str) -> str:
    """Return what stands between the quotes of GLFW's warnings, "(65550) b'X11: ...'"."""
    return str(warning).partition(" b'")[2].rstrip("'") or str(warning)


def monitor_record(monitor: Any) -> Monitor:
    """Return the record of one of GLFW's monitors."""
    name: Any = glfw.get_monitor_name(monitor)  # bytes: the stub is wrong
    mode = glfw.get_video_mode(monitor)
    width_mm = glfw.get_monitor_physical_size(monitor)[0]
    return Monitor(name.decode(errors="replace"), *glfw.get_monitor_pos(monitor), *mode.size, width_mm)


def _overlap(place: tuple[int, int, int, int], monitor: Any) -> int:
    """Return the area of a place that lies on a monitor."""
    (left, top), mode = glfw.get_monitor_pos(monitor), glfw.get_video_mode(monitor)
    across = min(place[0] + place[2], left + mode.size.width) - max(place[0], left)
    down = min(place[1] + place[3], top + mode.size.height) - max(place[1], top)
    return max(across, 0) * max(down, 0)


def _is_on_a_screen(place: tuple[int, int, int, int]) -> bool:
    """Return whether the middle of the upper edge, where one drags a window, can be seen."""
    x, y = place[0] + place[2] // 2, place[1]
    areas = [glfw.get_monitor_workarea(monitor) for monitor in glfw.get_monitors()]
    return any(left <= x < left + width and top <= y < top + height for left, top, width, height in areas)


def _open(title: str, place: tuple[int, int, int, int] | None, is_maximized: bool) -> Any:
    if not glfw.init():
        return None
    hint_context()
    glfw.window_hint(glfw.SCALE_TO_MONITOR, True)
    glfw.window_hint(glfw.MAXIMIZED, is_maximized)
    return glfw.create_window(*_size_within_screens(place), title, None, None)


def hint_context() -> None:
    """Ask for OpenGL 3.3 core in the next window, and for the names by which desktops find the program's icon."""
    glfw.default_window_hints()
    glfw.window_hint_string(glfw.X11_CLASS_NAME, "iibr")
    glfw.window_hint_string(glfw.X11_INSTANCE_NAME, "iibr")
    glfw.window_hint_string(glfw.WAYLAND_APP_ID, "io.github.iibr.iibr")
    glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
    glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
    glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
    glfw.window_hint(glfw.OPENGL_FORWARD_COMPAT, True)


def _size_within_screens(place: tuple[int, int, int, int] | None) -> tuple[int, int]:
    """Return the size of a new window: no larger than the largest screen, and large enough to be seen."""
    if place is None:
        return WINDOW_SIZE
    areas = [glfw.get_monitor_workarea(monitor) for monitor in glfw.get_monitors()] or [(0, 0, *WINDOW_SIZE)]
    widest, highest = (max(area[side] for area in areas) for side in (2, 3))
    width, height = max(place[2], SMALLEST_SIZE[0]), max(place[3], SMALLEST_SIZE[1])
    return min(width, max(widest, WINDOW_SIZE[0])), min(height, max(highest, WINDOW_SIZE[1]))
