"""A second window that fills a monitor with a texture of the first one. Its mouse and keys count as the first's."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import partial
from typing import Any

# isort: off
from imgui_bundle import imgui
import glfw

# isort: on
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.app.window import Window, hint_context, monitor_record
from viewer.gpu.context import create_for_window
from viewer.gpu.weaving import show_texture
from viewer.model.state.stereo import Monitor

Place = Callable[[float, float], tuple[float, float]]
"""Function from a pixel of this window to a place in the first one, in its units."""


class SecondWindow:
    """A full-screen window on a monitor. place: see `Place`; it may be replaced."""

    def __init__(self, first: Window, monitor: Monitor) -> None:
        """Open it; the first window's context stays current. Raises InputError."""
        self.monitor, self._first = monitor, first
        self.place: Place = lambda x, y: (x, y)
        self.handle: Any = None
        hint_context()
        for found in (each for each in glfw.get_monitors() if monitor_record(each) == monitor):
            for hint in (glfw.AUTO_ICONIFY, glfw.CENTER_CURSOR):
                glfw.window_hint(hint, False)
            glfw.window_hint(glfw.REFRESH_RATE, glfw.get_video_mode(found).refresh_rate)
            self.handle = glfw.create_window(monitor.width, monitor.height, "iibr", found, first.handle)
        if not self.handle:
            raise InputError(f"{monitor.words}: no window can be opened there")
        self._gl = create_for_window(self.handle)
        glfw.swap_interval(1)
        first.wait_for_screen(False)  # two windows that wait would halve the frame rate
        self._listen()

    @property
    def size_px(self) -> ScreenSize:
        """Width and height in pixels."""
        return ScreenSize(*glfw.get_framebuffer_size(self.handle))

    def show(self, texture: int, size_px: ScreenSize) -> None:
        """Show a texture of the first window's context, which stays current."""
        glfw.make_context_current(self.handle)
        show_texture(self._gl, texture, size_px)
        glfw.swap_buffers(self.handle)
        glfw.make_context_current(self._first.handle)

    def take_closing(self) -> bool:
        """Return whether the user asked to close the window."""
        return bool(glfw.window_should_close(self.handle))

    def close(self) -> None:
        """Close the window."""
        glfw.make_context_current(self.handle)
        self._gl.release()
        self._first.wait_for_screen(True)
        glfw.destroy_window(self.handle)

    def _listen(self) -> None:
        """Pass mouse and keys on to ImGui as if they were the first window's."""
        first = ctypes.cast(self._first.handle, ctypes.c_void_p).value or 0

        def move(_: Any, x: float, y: float) -> None:
            ratio = self.size_px.width / max(glfw.get_window_size(self.handle)[0], 1)
            imgui.backends.glfw_cursor_pos_callback(first, *self.place(x * ratio, y * ratio))

        for name in ("key", "mouse_button", "scroll", "cursor_enter"):
            take = partial(_pass_on, getattr(imgui.backends, f"glfw_{name}_callback"), first)
            getattr(glfw, f"set_{name}_callback")(self.handle, take)
        glfw.set_cursor_pos_callback(self.handle, move)


def _pass_on(callback: Callable[..., None], window: int, _: Any, *event: float) -> None:
    callback(window, *event)
