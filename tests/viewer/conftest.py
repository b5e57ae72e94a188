"""Small scenes on disk, a private X server, and the viewer driven step by step until something is true."""

import ctypes
import subprocess
import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from iibr_core.types import GridShape
from tests.xvfb import private_display
from viewer.model import messages
from viewer.model.action import do

WIDTH, HEIGHT = 96, 64
NEAR, FAR = 2.0, -1.0
EGL_DRAW, EGL_READ = 0x3059, 0x305A
SMALL_WINDOW = 0, 0, 560, 800
"""x, y, width, height: high enough for most of the panel; a small picture, as each test waits for it to converge."""
WIDE_WINDOW = 0, 0, 720, 800
"""For what needs room beside the panel."""
SCROLL_DOWN = 5
"""The button that the X server takes for a turn of the wheel."""
FRAME_CORNERS = 8
"""Of those that ImGui draws a frame with, inside and outside: more than that may be a line to the pointer."""
BORDER_PX = 8
"""Height at the bottom of a window in which a widget may be cut off."""
DEADLINE_S = 120.0
"""For a condition that always comes true; generous, because the first run compiles the core."""


def write_scene(folder, name="scene", seed=0):
    """A photo with its sidecar: a near red square, in the middle, before a far grey wall. Returns the photo's path."""
    from iibr_core.formats.images.write import write_image

    rng = np.random.default_rng(seed)
    pixels = rng.integers(60, 200, (HEIGHT // 8, WIDTH // 8, 1)).repeat(8, 0).repeat(8, 1).repeat(3, 2).astype(np.uint8)
    disparity = np.full((HEIGHT, WIDTH), FAR, np.float32)
    near = np.s_[HEIGHT // 4 : 3 * HEIGHT // 4, WIDTH // 3 : 2 * WIDTH // 3]
    pixels[near] = pixels[near] // 3 + np.array([150, 0, 0], np.uint8)
    disparity[near] = NEAR
    write_image(folder / f"{name}.png", pixels)
    np.save(folder / f"{name}_disparity.npy", disparity)
    return folder / f"{name}.png"


@contextmanager
def headless_with_scene(folder, *open_sections):
    """A scene opened without a window, its notices gone; open_sections: of the panel, with those that they lie in, the
    ones that are used most if none. The panel is there however narrow the window is.
    """
    from iibr_core.scenes.scene import Source
    from viewer.display.offscreen import OffscreenScene
    from viewer.model.preferences import with_sections

    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(write_scene(folder)), grid=GridShape(3, 3)))
        viewer.do(*(do(messages.dismiss, notice) for notice in viewer.state.notices))
        sections = with_sections((), *(open_sections or ("view", "focus", "aperture", "light")))
        preferences = replace(viewer.state.preferences, open_sections=sections)
        viewer.state = replace(viewer.state, preferences=preferences, hides_panel=False)
        yield viewer


@pytest.fixture
def viewer(opened):
    """What a module's `opened` gives, its state put back after every test."""
    before = opened.state
    yield opened
    opened.state = before


@pytest.fixture(scope="session")
def display():
    """A private X server; DISPLAY names it while the session runs."""
    with private_display() as name:
        yield name


def reduce(state, action):
    """The state after an action."""
    return action.apply(state)


def rests(app):
    """Whether nothing is left to do in a window, and nothing to be looked for soon."""
    from viewer.app import main_loop

    return app.wait_s == main_loop.IDLE_WAIT_S


def says(words):
    """The condition that a notice has these words."""
    return lambda app: any(words in notice.text for notice in app.state.notices)


def shows(name):
    """The condition that this photo is open."""
    return lambda app: app.state.scene is not None and app.state.scene.name == name


def has_all_views(state):
    """Whether all views are there, made with the newest settings: progress is that of the views before until then."""
    return state.progress.is_complete and state.shown_generation == state.generation


@dataclass
class Driver:
    """A viewer in a window, its loop turned by the test, its mouse and keys moved by the X server."""

    app: Any

    def until(self, condition):
        """Turn the loop until the condition holds."""
        end = time.monotonic() + DEADLINE_S
        while not condition(self.app):
            assert time.monotonic() < end, f"never came true; state: {self.app.state}"
            self.app.step()

    def until_idle(self):
        """Turn the loop until every view is there and nothing is left to do; what was sent before is heard first."""
        self.app.step()
        self.until(lambda app: has_all_views(app.state) and rests(app))
        return self

    def settle(self, condition):
        """Turn the loop until the condition holds, and until nothing is left to do."""
        self.until(condition)
        self.until_idle()

    def do(self, *actions, until=None, settle=None):
        """Do something that no hand does, and turn the loop until nothing is left to do, or a condition holds."""
        self.app.do(*actions)
        if until is None and settle is None:
            self.until_idle()
        self._wait(until, settle)

    def _wait(self, until, settle):
        if until is not None:
            self.until(until)
        if settle is not None:
            self.settle(settle)

    def send(self, *words):
        """Let xdotool do something."""
        subprocess.run(["xdotool", *map(str, words)], check=True)

    def position(self, x_share, y_share):
        """Screen position of a place in the picture, as shares of its width and height."""
        picture = self.app.layout().picture
        return round(picture.x + x_share * picture.width), round(picture.y + y_share * picture.height)

    def find(self, widget, window="panel"):
        """Move the pointer onto the widget of this ImGui name in a window, and say where that is; where it is not to be
        seen, scroll down.
        """
        from imgui_bundle import imgui

        self.until(lambda app: imgui.internal.find_window_by_name(window) is not None)
        frame = imgui.internal.find_window_by_name(window)
        wanted = frame.get_id(widget)
        while (place := self._place_of(wanted)) is None or place[1] > frame.pos.y + frame.size.y - BORDER_PX:
            if self.app.wait_s == 0:  # what was sent before may still bring it
                continue
            before = frame.scroll.y
            assert before < frame.scroll_max.y, f"no {widget} in {window}"
            self.send("mousemove", round(frame.pos.x + frame.size.x / 2), round(frame.pos.y + frame.size.y / 2))
            self.send("click", "--repeat", 5, SCROLL_DOWN)
            self.until(lambda app, before=before: frame.scroll.y > before)
        self.send("mousemove", *place)
        self.until(lambda app: imgui.get_current_context().hovered_id == wanted)
        return place

    def _place_of(self, widget):
        """The middle of the ImGui item of this id, around which ImGui draws a frame when asked; None where it is not to
        be seen.
        """
        import glfw
        from imgui_bundle import imgui

        imgui.internal.debug_locate_item(widget)
        glfw.post_empty_event()
        self.app.step()
        drawn = imgui.get_foreground_draw_list(imgui.get_main_viewport()).vtx_buffer
        corners = [corner.pos for corner in drawn][:FRAME_CORNERS]
        if not corners:
            return None
        left, right = (pick(corner.x for corner in corners) for pick in (min, max))
        top, bottom = (pick(corner.y for corner in corners) for pick in (min, max))
        return round((left + right) / 2), round((top + bottom) / 2)

    def open_sections(self, *sections):
        """Have these sections of the panel open, with those that they lie in, and no others."""
        from viewer.model.preferences import with_sections

        preferences = replace(self.app.state.preferences, open_sections=with_sections((), *sections))
        self.app.state = replace(self.app.state, preferences=preferences)

    def drop(self, path, until=None, settle=None):
        """Drop a file on the window, and turn the loop until what that leads to."""
        self.app.window.on_drop(None, [str(path)])
        self._wait(until, settle)

    def key(self, keys, until=None, settle=None):
        """Press keys together, and turn the loop until what they lead to."""
        self.send("key", keys)
        self._wait(until, settle)

    def press(self, widget, window="panel", until=None, settle=None):
        """Click a widget, and turn the loop until what that leads to."""
        self.find(widget, window)
        self.send("click", 1)
        self.app.step()
        self._wait(until, settle)

    def drag(self, *places, until):
        """Press at the first place of the screen, go to the others, and let go once the condition holds."""
        self.send("mousemove", *places[0], "mousedown", 1)
        for place in places[1:]:
            self.app.step()
            self.send("mousemove", *place)
        self.until(until)
        self.send("mouseup", 1)
        self.until_idle()

    def slide(self, widget, share):
        """Drag a slider of the panel to this share of its width."""
        from imgui_bundle import imgui

        panel = self.app.layout().panel
        x, y = self.find(widget)
        left, right = panel.x + 0.40 * panel.width, panel.x + 0.95 * panel.width
        self.send("mousemove", x, y, "mousedown", 1)
        self.app.step()
        end = round(left + share * (right - left))
        self.send("mousemove", end, y)
        self.until(lambda app: imgui.get_io().mouse_pos.x == end)
        self.send("mouseup", 1)
        self.until_idle()

    def type(self, text):
        """Type into the field that has the keyboard, in place of what it holds."""
        self.send("key", "ctrl+a")
        self.send("type", "--delay", 20, text)
        self.until_idle()

    def enter(self, text, until=None, settle=None):
        """Type and press Enter, and turn the loop until what that leads to."""
        self.type(text)
        self.key("Return", until, settle)

    def close(self):
        """Close the window, as leaving the program does."""
        self.app.close()

    def texts(self):
        """The words of all notices."""
        return [notice.text for notice in self.app.state.notices]

    def image(self):
        """The picture as it was drawn last."""
        return self.app.scene_view.renderer.read_image()

    def red_place(self):
        """The middle (x, y) of the near square in the picture, in pixels: nothing else is red."""
        image = self.image().astype(int)
        rows, columns = np.nonzero(image[..., 0] > image[..., 1] + 60)
        return columns.mean(), rows.mean()

    def field_disparity(self, given):
        """About the disparity of the views for one that was given."""
        plan = self.app.state.scene.plan
        return pytest.approx((given - plan.disparity_zero) * plan.disparity_scale, abs=1e-3)


@pytest.fixture
def no_egl_context():
    """Puts an EGL context of other tests aside: a window's GLX context cannot be current beside it."""
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        yield
        return
    for name in ("eglGetCurrentContext", "eglGetCurrentDisplay", "eglGetCurrentSurface"):
        getattr(egl, name).restype = ctypes.c_void_p
    egl.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4
    context, display = egl.eglGetCurrentContext(), egl.eglGetCurrentDisplay()
    draw, read = (egl.eglGetCurrentSurface(which) for which in (EGL_DRAW, EGL_READ))
    if context:
        egl.eglMakeCurrent(display, None, None, None)
    yield
    if context:
        egl.eglMakeCurrent(display, draw, read, context)


@pytest.fixture
def wide_window(monkeypatch):
    """Windows open with room beside the panel."""
    monkeypatch.setattr("tests.viewer.conftest.SMALL_WINDOW", WIDE_WINDOW)


@pytest.fixture
def open_window(display, no_egl_context):
    """Opens the viewer on a photo's path, or None; kept_in: where preferences are kept; changes: of the `Source`, which
    has 3x3 views. The sections that are used most are open; the window closes after the test.
    """
    from iibr_core.scenes.scene import Source
    from viewer.app.main_loop import App, initial_state
    from viewer.model.app_state import AppState
    from viewer.model.preferences import Preferences, with_sections

    apps = []
    sections = with_sections((), "view", "focus", "aperture", "light")

    def start(path, kept_in=None, **changes):
        state = initial_state(Source(str(path), **{"grid": GridShape(3, 3)} | changes)) if path else None
        preferences = Preferences(window=SMALL_WINDOW, open_sections=sections)
        apps.append(App(replace(state or AppState(), preferences=preferences, hides_panel=False), kept_in))
        return Driver(apps[-1])

    yield start
    for app in apps:
        if app.window.handle is not None:
            app.close()
