"""A real window on a private X server, moved by real mouse and key events."""

import ctypes
import json
import re
import subprocess

import glfw
import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.types import CENTRE, GridShape, ViewOffset
from tests.viewer.conftest import FAR, NEAR, says, shows, write_scene
from viewer.app.pointer import units_per_view
from viewer.app.preferences_store import PREFERENCES_FILE
from viewer.display.scene_view import WAITING_VIEWS
from viewer.model import lens, messages
from viewer.model.action import do


def icon_sizes(driver):
    """Widths of the window's icons: X11 keeps for each its width, its height and its pixels."""
    window = str(glfw.get_x11_window(driver.app.window.handle))
    words = f"xprop -id {window} -notype -len 100000 -f _NET_WM_ICON 32c _NET_WM_ICON".split()
    output = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    numbers, sizes = [int(word) for word in re.findall(r"\d+", output)], []
    while numbers:
        sizes.append(numbers[0])
        del numbers[: 2 + numbers[0] * numbers[1]]
    return sizes


def test_the_first_picture_comes_before_the_views(open_window, photo_path):
    driver = open_window(photo_path, grid=None)
    driver.until(lambda app: app.frames_shown > 0)
    assert icon_sizes(driver) == [], "it would delay the picture"
    driver.until(lambda app: app.scene_view.pictures_drawn > 0)
    assert driver.app.scene_view.field.present.sum() <= WAITING_VIEWS
    assert driver.image().std() > 10
    assert icon_sizes(driver) == [16, 32, 48]
    driver.close()
    empty = open_window(None)
    empty.until(lambda app: app.frames_shown > 0)
    assert icon_sizes(empty) == [16, 32, 48]


def test_views_that_the_graphics_card_cannot_hold_are_an_error(open_window, photo_path, monkeypatch):
    driver = open_window(photo_path, grid=GridShape(5, 5))
    monkeypatch.setitem(driver.app.scene_view.renderer.ctx.info, "GL_MAX_ARRAY_TEXTURE_LAYERS", 10)
    driver.until(says("use at most 3x3 views"))
    driver.app.do(do(messages.dismiss))


def test_drags_move_the_viewpoint_whole_however_few_frames_they_take(viewer):
    app, (x, y), before = viewer.app, viewer.position(0.5, 0.5), viewer.red_place()
    scene = app.state.scene
    per_view = units_per_view(app.layout(), scene)
    for moves in (1, 5):
        words = ["mousemove", x, y, "mousedown", 1]
        for k in range(1, moves + 1):
            words += ["mousemove", x + round(60 * k / moves), y + round(10 * k / moves)]
        viewer.send(*words, "mouseup", 1)
        viewer.settle(lambda app: app.state.optics.eye != CENTRE)
        assert app.state.optics.eye == pytest.approx(ViewOffset(-10 / per_view, -60 / per_view))
        assert app.state.optics.focus_disparity == 0, "a drag is no click"
        assert viewer.red_place()[0] > before[0], "near things follow the hand"
        app.do(do(lens.reset))
        viewer.until_idle()


def test_clicks_focus_the_wheel_refocuses_and_keys_move(viewer):
    pinhole = viewer.image()
    for place, given in (((0.5, 0.5), NEAR), ((0.1, 0.1), FAR)):
        viewer.send("mousemove", *viewer.position(*place), "click", 1)
        wanted = viewer.field_disparity(given)
        viewer.settle(lambda app, wanted=wanted: app.state.optics.focus_disparity == wanted)
    focus = viewer.app.state.optics.focus_disparity
    assert (viewer.image() != pinhole).any(), "the first click opens the aperture: else nothing would be seen"
    viewer.send("click", 4)
    viewer.until(lambda app: app.state.optics.focus_disparity > focus)
    viewer.key("Down", until=lambda app: app.state.optics.eye.t > 0)
    viewer.key("r", until=lambda app: app.state.optics == Optics())
    for key, eye in (
        ("Right", (0, 0.5)),
        ("Up", (-0.5, 0.5)),
        ("Left", (-0.5, 0)),
        ("Down", (0, 0)),
        ("Right", (0, 0.5)),
    ):
        viewer.key(key, until=lambda app, eye=eye: app.state.optics.eye == eye)
    viewer.send("mousemove", *viewer.position(0.5, 0.5), "click", "--repeat", 2, "--delay", 40, 1)
    viewer.until(lambda app: app.state.optics == Optics())
    viewer.send("key", "Escape")
    viewer.until_idle()
    assert not viewer.app.state.should_quit
    viewer.key("ctrl+q", until=lambda app: app.state.should_quit)


def test_idle_draws_nothing_a_pointer_on_the_panel_no_picture_and_a_slider_is_one_edit(viewer):
    app, before = viewer.app, viewer.image()
    viewer.settle(lambda app: None not in (app.state.facts, app.state.folder) and bool(app.state.models.known))
    shown, drawn = app.frames_shown, app.scene_view.pictures_drawn
    for _ in range(50):
        glfw.post_empty_event()
        app.step()
        assert app.wait_s > 0
    assert (app.frames_shown, app.scene_view.pictures_drawn) == (shown, drawn)
    window = glfw.get_x11_window(app.window.handle)
    viewer.send("windowunmap", "--sync", window, "windowmap", "--sync", window)
    viewer.settle(lambda app: app.frames_shown > shown)  # what was covered is drawn again
    shown, panel = app.frames_shown, app.layout().panel
    for y in range(60, 260, 40):
        viewer.send("mousemove", int(panel.x + 0.8 * panel.width), y)
        viewer.until_idle()
    assert app.frames_shown > shown, "sliders light up"
    assert app.scene_view.pictures_drawn == drawn
    viewer.slide("##Aperture", 0.8)
    assert viewer.app.state.optics.aperture_diameter > 1
    assert viewer.app.state.optics.eye == ViewOffset(0, 0)
    assert np.abs(viewer.image().astype(int) - before).max() > 8
    assert len(viewer.app.state.history.past) == 1, "a drag is one edit"


def test_a_dropped_photo_opens_and_a_broken_file_leaves_it_open(viewer, tmp_path):
    viewer.app.window.on_drop(None, [str(write_scene(tmp_path, "other", seed=1))])
    viewer.settle(shows("other"))
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"this is no picture")
    before = viewer.image()
    viewer.drop(broken, until=lambda app: bool(app.state.notices))
    assert viewer.app.state.notices[0].is_error
    assert "broken.png" in viewer.app.state.notices[0].text
    viewer.until_idle()
    assert viewer.app.state.scene.name == "other"
    np.testing.assert_array_equal(viewer.image(), before)
    # A name that is no text, as GLFW hands it over: its wrapper raises in the midst of the loop.
    ((_, callback),) = glfw._window_drop_callback_repository.values()
    callback(viewer.app.window.handle, 1, (ctypes.c_char_p * 1)(b"/gone/\xff.png"))
    viewer.until(says("no such file"))


@pytest.mark.parametrize("kept", [[40, 50, 600, 700], [0, 0, 40_000, 40_000], [0, 0, 1e308, float("nan")]])
def test_a_window_opens_where_it_was_left_and_no_larger_than_the_screen(open_window, tmp_path, kept):
    (tmp_path / PREFERENCES_FILE).write_text(json.dumps({"window": kept}))
    window = open_window(None, kept_in=tmp_path).app.window
    _, _, width, height = glfw.get_monitor_workarea(glfw.get_primary_monitor())
    assert 200 <= window.size.width <= width
    assert 150 <= window.size.height <= height
    assert window.place == tuple(kept) or kept[2] != 600


def test_views_come_nearest_first_to_where_the_user_looks(open_window, photo_path):
    """From the hand to the worker: the viewpoint in a corner, the views made again."""
    driver = open_window(photo_path, grid=GridShape(9, 9)).until_idle()
    before = driver.app.state.scene
    driver.app.do(do(lens.move_eye, ViewOffset(-4.0, -4.0)), do(lens.set_depth_strength, 1.5, is_finished=True))
    driver.until(lambda app: app.state.scene is not before)
    arrived = []

    def is_done(app):
        arrived.extend(sorted(app.state.views_there.difference(arrived)))
        return len(arrived) == 81

    driver.until(is_done)
    distances = [row + column for row, column in arrived]
    # The photo and the outer views come first, wherever the user looks.
    first, last = distances[9:45], distances[45:]
    assert sum(first) < 0.7 * sum(last)
