"""The stereo picture that the state asks for: in a second window that fills a monitor, or in the first one."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

# isort: off
from imgui_bundle import imgui
import glfw

# isort: on
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.app.pointer import Pointer
from viewer.app.window import Window, hint_context, monitor_record
from viewer.display.scene_view import SceneView
from viewer.display.stereo_view import StereoView, WovenPicture
from viewer.gpu.context import GLContext, create_for_window
from viewer.gpu.render_targets import RenderTarget
from viewer.gpu.weaving import show_texture
from viewer.model import messages, stereo
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.layout import Layout
from viewer.model.messages import Notice
from viewer.model.stereo import Monitor, Weave


class SecondWindow:
    """A full-screen window on a monitor. Its mouse and keys count as the first window's.

    place: function from a pixel of this window to a place in the first one, in its units; it may be replaced.
    """

    def __init__(self, first: Window, monitor: Monitor) -> None:
        """Open it; the first window's context stays current. Raises InputError."""
        self.monitor, self._first = monitor, first
        self.place: Callable[[float, float], tuple[float, float]] = lambda x, y: (x, y)
        self._shown: WovenPicture | None = None
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

    def show(self, picture: WovenPicture, target: RenderTarget) -> None:
        """Show a picture of the first window's context, which stays current, unless it is shown already."""
        if picture == self._shown:
            return
        self._shown = picture
        glfw.make_context_current(self.handle)
        show_texture(self._gl, target.texture.glo, target.size_px)
        glfw.swap_buffers(self.handle)
        glfw.make_context_current(self._first.handle)

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

        def pass_on(name: str) -> None:
            callback = getattr(imgui.backends, f"glfw_{name}_callback")
            getattr(glfw, f"set_{name}_callback")(self.handle, lambda _, *event: callback(first, *event))

        for name in ("key", "mouse_button", "scroll", "cursor_enter"):
            pass_on(name)
        glfw.set_cursor_pos_callback(self.handle, move)


class StereoScreen:
    """Owner of the second window, None while it is closed, and of the stereo pictures."""

    def __init__(self, gl: GLContext, scene_view: SceneView, window: Window) -> None:
        self.view = StereoView(gl, scene_view)
        self._window = window
        self.second: SecondWindow | None = None

    @property
    def texture(self) -> int | None:
        """GL name of the picture that fills the first window, None unless it shows one."""
        return self.view.screen.texture.glo if self.view.drawn is not None and self.second is None else None

    def advance(self, state: AppState) -> list[Action]:
        """Open, move or close the second window as the state asks; return what the user or the system changed."""
        monitors, wanted = self._window.monitors, state.stereo.monitor if state.stereo.is_shown else None
        if monitors != state.monitors:
            return [do(stereo.set_monitors, monitors)]
        if self.second is not None and glfw.window_should_close(self.second.handle):
            return [do(stereo.show, False)]
        if self.second is not None and self.second.monitor != wanted:
            self.second.close()
            self.second = None
        if not state.stereo.is_shown and self.view.drawn is not None:
            self.view.release()
        if wanted is not None and self.second is None:
            try:
                self.second = SecondWindow(self._window, wanted)
            except InputError as error:
                self._window.wait_for_screen(True)
                return [do(stereo.show, False), do(messages.notify, Notice(str(error), is_error=True))]
        return []

    def draw(self, state: AppState, layout: Layout) -> bool:
        """Draw the stereo picture, if it is shown; return whether it has changed."""
        size_px = self.second.size_px if self.second else self._window.framebuffer_size
        if not state.stereo.is_shown or state.scene is None or not all(size_px):
            return False
        weave, before = stereo.weave_of(state, state.scene, size_px), self.view.drawn
        picture = self.view.draw(weave)
        if self.second is not None and picture is not None:
            self.second.place = partial(place_in_window, weave, layout)
            self.second.show(picture, self.view.screen)
        return picture != before

    def pointer(self, pointer: Pointer, layout: Layout) -> Pointer:
        """Return the pointer over the picture beside the panel, if it is over a stereo picture in the first window."""
        if self.second is not None or self.view.drawn is None:
            return pointer
        ratio, place = layout.pixel_ratio, partial(place_in_window, self.view.drawn.weave, layout)
        x, y = place(ratio * pointer.x, ratio * pointer.y)
        pressed_x, pressed_y = place(ratio * pointer.pressed_x, ratio * pointer.pressed_y)
        return replace(pointer, x=x, y=y, pressed_x=pressed_x, pressed_y=pressed_y)

    def close(self) -> None:
        """Close the second window and free everything."""
        if self.second is not None:
            self.second.close()
        self.view.release()


def place_in_window(weave: Weave, layout: Layout, x_px: float, y_px: float) -> tuple[float, float]:
    """Return the place in the first window's picture under a pixel of the woven screen, in window units."""
    picture = layout.picture or Rect(0.0, 0.0, 0.0, 0.0)
    frame = layout.frame or picture
    across, down = stereo.place_in_photo(weave, x_px, y_px)
    x = clamp(picture.x + across * picture.width, frame.x, frame.x + frame.width - 1)
    return x, clamp(picture.y + down * picture.height, frame.y, frame.y + frame.height - 1)
