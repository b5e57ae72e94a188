"""Shows the stereo picture that the state asks for: in a second window on its monitor, or in the first one."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from iibr_core.scenes.rect import Rect
from iibr_core.types import InputError
from viewer.app.pointer import Pointer
from viewer.app.second_window import SecondWindow
from viewer.app.window import Window
from viewer.display.scene_view import SceneView
from viewer.display.stereo_view import StereoView, WovenPicture
from viewer.gpu.context import GLContext
from viewer.model import messages, stereo
from viewer.model.action import Action, do
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice
from viewer.model.state.stereo import Weave


class StereoScreen:
    """Owner of the second window and of the stereo pictures. picture: record of the last one, None while closed."""

    def __init__(self, gl: GLContext, scene_view: SceneView, window: Window) -> None:
        self.view = StereoView(gl, scene_view)
        self._window = window
        self.second: SecondWindow | None = None
        self.picture: WovenPicture | None = None

    @property
    def texture(self) -> int | None:
        """GL name of the picture that fills the first window, None unless it shows one."""
        return self.view.screen.texture.glo if self.picture is not None and self.second is None else None

    def follow(self, state: AppState) -> list[Action]:
        """Open, move or close the second window as the state asks; return what the user or the system changed."""
        monitors, wanted = self._window.monitors, state.stereo.monitor if state.stereo.is_shown else None
        if monitors != state.monitors:
            return [do(stereo.set_monitors, monitors)]
        if self.second is not None and self.second.take_closing():
            return [do(stereo.show, False)]
        if self.second is not None and self.second.monitor != wanted:
            self.second.close()
            self.second = None
        if not state.stereo.is_shown and self.picture is not None:
            self.view.release()
            self.picture = None
        if wanted is not None and self.second is None:
            self.picture = None
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
        weave, before = stereo.weave_of(state, state.scene, size_px), self.picture
        self.picture = self.view.draw(weave)
        if self.second is not None and self.picture is not None:
            self.second.place = partial(place_in_window, weave, layout)
            if self.picture != before:
                self.second.show(self.view.screen.texture.glo, size_px)
        return self.picture != before

    def pointer(self, pointer: Pointer, layout: Layout) -> Pointer:
        """Return the pointer over the picture beside the panel, if it is over a stereo picture in the first window."""
        if self.texture is None or self.picture is None:
            return pointer
        ratio, place = layout.pixel_ratio, partial(place_in_window, self.picture.weave, layout)
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
    x, y = picture.x + across * picture.width, picture.y + down * picture.height
    right, bottom = frame.x + frame.width - 1, frame.y + frame.height - 1
    return min(max(x, frame.x), right), min(max(y, frame.y), bottom)
