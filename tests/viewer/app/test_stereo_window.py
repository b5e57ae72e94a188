"""The stereo picture on a second monitor and in the window itself, read back from the screen."""

import json
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace

import glfw
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import ImageGrab

from iibr_core.evaluation.metrics import psnr
from iibr_core.exports.anaglyph import anaglyph
from iibr_core.exports.framing import centred, size_in_frame
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.lenticular import Calibration
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.fake_bridge import PORTRAIT, fake_bridge
from tests.viewer.conftest import Driver
from tests.xvfb import display_with_monitors
from viewer import entry
from viewer.app.pointer import Pointer
from viewer.app.preferences_store import load_preferences
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens, messages, preferences, stereo
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.stereo import STEREO_MODES, Monitor

FIRST, SECOND = ScreenSize(1024, 768), ScreenSize(640, 480)
CALIBRATION = {"pitch": 50, "slope": -7, "center": 0.2, "DPI": 300, "screenW": SECOND.width, "screenH": SECOND.height}
Pixels = NDArray[np.uint8]


@pytest.fixture(scope="module")
def display(tmp_path_factory):
    """A server with two monitors."""
    with display_with_monitors(tmp_path_factory.mktemp("x"), FIRST, SECOND) as name:
        yield name


@contextmanager
def eyes_of(viewer):
    """Draws the pictures of both eyes without a window, in rooms of a size and displayed aspect; the window is closed
    first, as its context cannot be current beside another.
    """
    state = viewer.app.state
    viewer.close()
    with OffscreenScene("egl") as scene:
        opened = scene.open(state.source)

        def draw(frame, aspect):
            pair = stereo.eyes_at(opened, state.optics, state.stereo)
            size = size_in_frame(opened, frame, pair[0].part, aspect)
            left, right = (scene.draw(RenderSettings(eye.optics, size, eye.part)) for eye in pair)
            return centred(left, frame), centred(right, frame)

        yield draw


def grabbed(display, left, size):
    """The screen from a column on."""
    return np.asarray(ImageGrab.grab((left, 0, left + size.width, size.height), xdisplay=display))[..., :3]


def woven(mode, draw, size):
    """The two pictures as a display of this kind expects them."""
    (width, height), aspect = size, size.width / size.height
    if mode == "top-bottom":
        return np.vstack(draw(ScreenSize(width, height // 2), aspect))
    if mode in ("sbs", "half-sbs", "cross-eyed"):
        pair = draw(ScreenSize(width // 2, height), aspect if mode == "half-sbs" else aspect / 2)
        return np.hstack(pair[::-1] if mode == "cross-eyed" else pair)
    left, right = draw(size, aspect)
    if mode == "anaglyph":
        return anaglyph(left, right)
    y, x = np.indices((height, width))
    is_right = {"rows": y, "columns": x, "checkerboard": x + y}[mode] % 2 == 1
    return np.where(is_right[..., None], right, left)


def test_all_arrangements_reach_the_second_monitor(viewer, display):
    viewer.app.do(do(stereo.show, True), do(stereo.set_screen, 0.5), do(lens.move_eye, ViewOffset(0.4, 0)))
    viewer.app.do(do(stereo.set_eyes, 1.5))
    shown = {}
    for mode in STEREO_MODES:
        viewer.do(do(stereo.set_mode, mode))
        shown[mode] = grabbed(display, FIRST.width, SECOND)
    viewer.app.do(do(stereo.set_mode, "columns"))
    viewer.key("l", settle=lambda app: app.state.preferences.swaps_eyes)
    swapped = grabbed(display, FIRST.width, SECOND)
    with eyes_of(viewer) as eyes:
        for mode, pixels in shown.items():
            assert psnr(pixels, woven(mode, eyes, SECOND)) >= 45, mode
        left, right = eyes(SECOND, SECOND.width / SECOND.height)
    near = [np.nonzero(picture[240, :, 0] > picture[240, :, 1] + 40)[0].mean() for picture in (left, right)]
    assert near[0] > near[1], "near things are further right in the left eye's picture"
    assert psnr(swapped[:, ::2], right[:, ::2]) >= 45


def test_mouse_and_keys_on_the_second_monitor_count(viewer):
    viewer.do(do(stereo.show, True), do(stereo.set_mode, "half-sbs"))
    viewer.send("mousemove", FIRST.width + 480, 240)
    viewer.until(lambda app: app.state.hover is not None and abs(app.state.hover.x_px - 48) < 2)
    places = (FIRST.width + 480, 240), (FIRST.width + 430, 240)
    viewer.drag(*places, until=lambda app: app.state.optics.eye.s > 0)
    focus = viewer.app.state.optics.focus_disparity
    viewer.send("click", 4)
    viewer.settle(lambda app: app.state.optics.focus_disparity > focus)
    picture = viewer.app.stereo_screen.view.drawn
    assert picture.weave.eyes[0].optics.focus_disparity == viewer.app.state.optics.focus_disparity
    viewer.key("Tab", until=lambda app: app.state.is_panel_hidden)
    viewer.key("Escape", settle=lambda app: not app.state.stereo.is_shown)
    assert viewer.app.stereo_screen.second is None


def test_a_monitor_that_goes_closes_the_picture_and_the_window_shows_it_alone(viewer, display):
    place = viewer.app.window.place
    viewer.key("3", settle=lambda app: app.stereo_screen.second is not None)
    subprocess.run(["xrandr", "--output", "DUMMY1", "--off"], check=True)
    try:
        viewer.until(lambda app: not app.state.stereo.is_shown)
        assert "DUMMY1" in viewer.app.state.notices[-1].text
        viewer.send("mousemove", 100, 300, "key", "3")
        viewer.until(lambda app: app.state.stereo.is_shown and app.window.is_fullscreen)
        viewer.do(do(stereo.set_mode, "anaglyph"), do(messages.dismiss))
        assert viewer.app.state.is_panel_hidden
        layout, at_pixel = viewer.app.layout(), viewer.app.stereo_screen.pointer
        finer = at_pixel(Pointer(100, 150, pressed_x=100, pressed_y=150), replace(layout, pixel_ratio=2.0))
        assert finer == at_pixel(Pointer(200, 300, pressed_x=200, pressed_y=300), layout), "units of two pixels"
        alone = grabbed(display, 0, FIRST)
        viewer.key("Tab", settle=lambda app: not app.state.is_panel_hidden)
        under_panel = grabbed(display, 0, FIRST)
        viewer.key("Escape", settle=lambda app: not app.state.stereo.is_shown and not app.window.is_fullscreen)
        assert viewer.app.window.place == place
    finally:
        subprocess.run(["xrandr", "--output", "DUMMY1", "--mode", "640x480", "--pos", f"{FIRST.width}x0"], check=True)
    with eyes_of(viewer) as eyes:
        wanted = woven("anaglyph", eyes, FIRST)
    assert psnr(alone, wanted) >= 45
    assert psnr(under_panel[:, :700], wanted[:, :700]) >= 45, "the panel lies over the picture"


def test_the_window_fills_the_monitor_that_most_of_it_lies_on(viewer):
    glfw.set_window_pos(viewer.app.window.handle, FIRST.width - 100, 30)
    viewer.until(lambda app: [each.name for each in app.state.monitors] == ["DUMMY1", "DUMMY0"])
    place = viewer.app.window.place
    viewer.key("F11", settle=lambda app: app.window.is_fullscreen and app.window.size == SECOND)
    assert glfw.get_window_pos(viewer.app.window.handle) == (FIRST.width, 0)
    viewer.key("F11", settle=lambda app: not app.window.is_fullscreen)
    assert viewer.app.window.place == place
    assert stereo.monitor_of(viewer.app.state).name == "DUMMY0", "a stereo picture goes to the other one"


def test_monitor_and_arrangement_are_remembered(open_window, photo_path, tmp_path):
    first = open_window(photo_path, tmp_path)
    first.until(lambda app: app.state.scene is not None)
    wanted = first.app.state.monitors[1]
    assert replace(wanted, width_mm=0) == Monitor("DUMMY1", FIRST.width, 0, *SECOND)
    first.app.do(do(stereo.choose_monitor, wanted), do(stereo.set_mode, "rows"), do(stereo.swap_eyes))
    first.app.step()
    first.close()
    kept = load_preferences(AppState(), tmp_path).preferences
    assert (kept.stereo_mode, kept.swaps_eyes, kept.stereo_monitor) == ("rows", True, wanted)
    second = open_window(photo_path, tmp_path)
    second.do(do(stereo.show, True), until=lambda app: app.stereo_screen.second is not None)
    assert second.app.stereo_screen.second.monitor == wanted


HEAD = "--tracker", "udp:45454", "--depth-strength", "0.5"


@pytest.mark.usefixtures("display", "no_egl_context")
@pytest.mark.parametrize("words", [("--stereo", "columns"), ("--calibration", "visual.json")])
def test_the_command_line_begins_with_it(photo_path, tmp_path, monkeypatch, words):
    shown = []
    (tmp_path / "visual.json").write_text(json.dumps(CALIBRATION))
    monkeypatch.chdir(tmp_path)

    def look(app, signals):
        Driver(app).until(lambda app: app.stereo_screen.view.drawn is not None)
        shown.append((app.stereo_screen.view.drawn, app.stereo_screen.second, app.state))

    monkeypatch.setattr("viewer.app.main_loop.App.run", look)
    monkeypatch.setattr("viewer.cli.view.user_folder", lambda: tmp_path / "kept")
    monkeypatch.setattr(sys, "argv", ["iibr", "view", str(photo_path), "--grid", "3", *words, *HEAD])
    assert entry.run() == 0
    ((picture, second, state),) = shown
    is_lenticular = words[0] == "--calibration"
    mode = "half-sbs" if is_lenticular else "columns"
    assert picture.weave.size_px == SECOND
    assert isinstance(picture.weave.arrangement, Calibration) if is_lenticular else picture.weave.arrangement == mode
    assert len(picture.weave.eyes) == (48 if is_lenticular else 2)
    assert second is not None
    assert (state.tracking.address, state.depth_strength) == ("udp:45454", 0.5)
    assert load_preferences(AppState(), tmp_path / "kept").preferences.stereo_mode == mode


def test_a_lenticular_display_that_bridge_knows_gets_its_picture(viewer, display, monkeypatch):
    with fake_bridge(monkeypatch) as bridge:
        place = {"x": FIRST.width, "y": 0}
        bridge.displays = [
            PORTRAIT | {"calibration": {"value": json.dumps(CALIBRATION)}, "windowCoords": {"value": place}}
        ]
        viewer.app.do(do(preferences.toggle_section, "stereo display"))
        picked = [len(STEREO_MODES)]  # the entry after those for both eyes

        def pick(name, *_):
            return picked.pop() if name == "Arrangement" and picked else None

        monkeypatch.setattr("viewer.ui.sections.stereo_section.combo", pick)
        viewer.settle(lambda app: app.stereo_screen.second is not None)
    viewer.app.do(do(lens.move_eye, ViewOffset(0.4, 0)))
    viewer.until(
        lambda app: (each := app.stereo_screen.view.drawn) is not None and each.weave.eyes[0].optics.eye.t == 0.4
    )
    viewer.until_idle()
    shown, state = grabbed(display, FIRST.width, SECOND), viewer.app.state
    viewer.close()
    with OffscreenScene("egl") as scene:
        scene.open(state.source)
        scene.state = replace(scene.state, stereo=state.stereo, optics=state.optics)
        wanted = scene.picture(SECOND)
    assert psnr(shown, wanted) >= 45
    assert (np.abs(shown[..., 1].astype(int) - shown[..., 2]) > 30).any(), "views differ within a pixel of a grey photo"
