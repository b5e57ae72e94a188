"""A real window on a private X server, moved by real mouse and key events."""

from __future__ import annotations

import ctypes
import json
import math
from pathlib import Path

import glfw
import numpy as np
import pytest
from imgui_bundle import imgui

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import FAR, NEAR, Driver, Opener, rests, write_scene
from viewer.app.main_loop import App
from viewer.app.pointer import units_per_view
from viewer.app.preferences_store import PREFERENCES_FILE
from viewer.display.scene_view import WAITING_VIEWS
from viewer.model import lens, messages
from viewer.model.action import do


@pytest.fixture
def viewer(open_window: Opener, photo_path: Path) -> Driver:
    """The scene open with all its views; the pointer rests in the picture, off the near square."""
    driver = open_window(photo_path, grid=GridShape(5, 5))
    driver.until_idle()
    driver.send("mousemove", *driver.position(0.1, 0.1))
    driver.until_idle()
    return driver


def shown_focus(viewer: Driver, given: float) -> float:
    """The field disparity of a given one."""
    scene = viewer.app.state.scene
    assert scene is not None
    assert scene.plan is not None
    return (given - scene.plan.disparity_zero) * scene.plan.disparity_scale


def test_the_first_picture_comes_before_the_views(open_window: Opener, photo_path: Path) -> None:
    driver = open_window(photo_path)
    driver.until(lambda app: app.scene_view.pictures_drawn > 0)
    assert driver.app.scene_view.renderer.field.present.sum() <= WAITING_VIEWS
    assert driver.image().std() > 10


def test_views_that_the_graphics_card_cannot_hold_are_an_error(
    open_window: Opener, photo_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    driver = open_window(photo_path, grid=GridShape(5, 5))
    monkeypatch.setitem(driver.app.scene_view.renderer.ctx.info, "GL_MAX_ARRAY_TEXTURE_LAYERS", 10)
    driver.until(lambda app: any("use at most 3x3 views" in notice.text for notice in app.state.notices))
    driver.app.do(do(messages.dismiss))


def test_a_drag_moves_the_viewpoint_and_the_picture(viewer: Driver) -> None:
    before = viewer.image()
    x, y = viewer.position(0.5, 0.5)
    viewer.send("mousemove", x, y, "mousedown", 1)
    viewer.send("mousemove", x + 100, y)
    viewer.send("mousemove", x + 200, y + 40)
    viewer.until(lambda app: app.state.optics.eye.s < -0.5 and app.state.optics.eye.t < 0)
    viewer.send("mouseup", 1)
    viewer.until_idle()
    assert viewer.app.state.optics.focus_disparity == 0, "a drag is no click"
    near_before, near_after = near_centre(before), near_centre(viewer.image())
    assert near_after > near_before, "near things follow the hand"


@pytest.mark.parametrize("moves", [1, 2, 5])
def test_a_quick_drag_loses_no_motion(viewer: Driver, moves: int) -> None:
    """All of it may come in one frame, the release included."""
    app, (x, y) = viewer.app, viewer.position(0.5, 0.5)
    scene = app.state.scene
    assert scene is not None
    words: list[object] = ["mousemove", x, y, "mousedown", 1]
    for k in range(1, moves + 1):
        words += ["mousemove", x - round(60 * k / moves), y + round(10 * k / moves)]
    viewer.send(*words, "mouseup", 1)
    viewer.until(lambda app: app.state.optics.eye != ViewOffset(0, 0))
    viewer.until_idle()
    per_view = units_per_view(app.layout(), scene)
    assert app.state.optics.eye == pytest.approx(ViewOffset(-10 / per_view, 60 / per_view))
    assert app.state.optics.focus_disparity == 0


def near_centre(image: np.ndarray) -> float:
    """Where the near square is, across: nothing else is red."""
    red = image[..., 0].astype(int) - image[..., 1] > 60
    return float(np.nonzero(red)[1].mean())


def test_a_click_focuses_on_the_surface_under_it(viewer: Driver) -> None:
    for place, given in (((0.5, 0.5), NEAR), ((0.1, 0.1), FAR)):
        viewer.send("mousemove", *viewer.position(*place), "click", 1)
        wanted = pytest.approx(shown_focus(viewer, given), abs=1e-3)
        viewer.until(lambda app, wanted=wanted: app.state.optics.focus_disparity == wanted)  # type: ignore[misc]
        viewer.until_idle()


def test_the_first_click_is_seen(viewer: Driver) -> None:
    """Through a pinhole it would change nothing."""
    before = viewer.image()
    for place in ((0.5, 0.5), (0.1, 0.1)):
        focus = viewer.app.state.optics.focus_disparity
        viewer.send("mousemove", *viewer.position(*place), "click", 1)
        viewer.until(lambda app, focus=focus: app.state.optics.focus_disparity != focus)  # type: ignore[misc]
        viewer.until_idle()
    assert viewer.app.state.optics.aperture_diameter > 0
    assert (viewer.image() != before).any()


def test_a_double_click_resets(viewer: Driver) -> None:
    viewer.send("key", "Right")
    viewer.until(lambda app: app.state.optics.eye == ViewOffset(0, 0.5))
    viewer.send("mousemove", *viewer.position(0.5, 0.5), "click", "--repeat", 2, "--delay", 40, 1)
    viewer.until(lambda app: app.state.optics == Optics())


def test_a_double_click_counts_where_frames_are_slow(viewer: Driver) -> None:
    """Of two clicks the second is heard of only after the frame that the first one asked for."""
    viewer.app._pace.took_s.extend(3 * [1.5])
    viewer.app.step()
    assert imgui.get_io().mouse_double_click_time > 4.5


def test_the_wheel_changes_the_focus_and_keys_the_viewpoint(viewer: Driver) -> None:
    viewer.send("click", 4)
    viewer.until(lambda app: app.state.optics.focus_disparity > 0)
    viewer.send("key", "Down")
    viewer.until(lambda app: app.state.optics.eye.t > 0)
    viewer.send("key", "r")
    viewer.until(lambda app: app.state.optics == Optics())


def test_a_slider_changes_the_aperture_and_not_the_viewpoint(viewer: Driver) -> None:
    before = viewer.image()
    viewer.slide("##Aperture", 0.8)
    assert viewer.app.state.optics.aperture_diameter > 1
    assert viewer.app.state.optics.eye == ViewOffset(0, 0)
    assert np.abs(viewer.image().astype(int) - before).max() > 8
    assert len(viewer.app.state.history.past) == 1, "a drag is one edit"


def test_an_idle_window_draws_nothing_however_often_it_is_woken(viewer: Driver) -> None:
    app = viewer.app
    shown, drawn = app.frames_shown, app.scene_view.pictures_drawn
    for _ in range(50):
        glfw.post_empty_event()
        app.step()
        assert app.wait_s > 0
    assert (app.frames_shown, app.scene_view.pictures_drawn) == (shown, drawn)


def test_moving_the_pointer_over_the_panel_does_not_draw_the_picture_again(viewer: Driver) -> None:
    app = viewer.app
    shown, drawn = app.frames_shown, app.scene_view.pictures_drawn
    panel = app.layout().panel
    for y in range(60, 260, 20):
        viewer.send("mousemove", int(panel.x + 0.8 * panel.width), y)
        viewer.until_idle()
    assert app.frames_shown > shown, "sliders light up"
    assert app.scene_view.pictures_drawn == drawn


def test_a_dropped_photo_replaces_the_scene(viewer: Driver, tmp_path: Path) -> None:
    other = write_scene(tmp_path, "other", seed=1)
    viewer.app.window.on_drop(None, [str(other)])
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.name == "other")
    viewer.until_idle()
    assert viewer.app.state.optics == Optics()


def test_a_broken_file_gives_a_notice_and_the_scene_stays(viewer: Driver, tmp_path: Path) -> None:
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"this is no picture")
    before = viewer.image()
    viewer.app.window.on_drop(None, [str(broken)])
    viewer.until(lambda app: bool(app.state.notices))
    assert viewer.app.state.notices[0].is_error
    assert "broken.png" in viewer.app.state.notices[0].text
    viewer.until_idle()
    assert viewer.app.state.scene is not None
    assert viewer.app.state.scene.name == "scene"
    np.testing.assert_array_equal(viewer.image(), before)


def test_another_depth_strength_makes_the_views_anew_without_reading_the_photo(
    viewer: Driver, photo_path: Path
) -> None:
    photo_path.unlink()
    scene = viewer.app.state.scene
    assert scene is not None
    viewer.slide("##Depth strength", 0.9)
    assert viewer.app.state.generation == 2
    assert viewer.app.state.depth_strength > 1
    viewer.until(lambda app: app.scene_view.generation == 2)
    viewer.until_idle()
    again = viewer.app.state.scene
    assert again is not None
    assert again.disparity_range_px != scene.disparity_range_px or again.grid != scene.grid
    assert not viewer.app.state.notices


def test_escape_never_quits_and_ctrl_q_does(viewer: Driver) -> None:
    viewer.send("key", "Escape")
    viewer.until_idle()
    assert not viewer.app.state.should_quit
    viewer.send("key", "ctrl+q")
    viewer.until(lambda app: app.state.should_quit)


def test_a_window_without_a_scene_says_what_to_do(open_window: Opener) -> None:
    driver = open_window(None)
    driver.until(lambda app: app.frames_shown > 0)
    assert driver.app.state.scene is None


def test_a_missing_file_leaves_an_empty_window_with_a_notice(open_window: Opener, tmp_path: Path) -> None:
    driver = open_window(tmp_path / "gone.png")
    driver.until(lambda app: bool(app.state.notices))
    assert "gone.png" in driver.app.state.notices[0].text
    assert driver.app.state.source == Source(str(tmp_path / "gone.png"))


@pytest.mark.parametrize("kept", [[0, 0, 40_000, 40_000], [-90_000, 90_000, 100_000, 200], [0, 0, 1e308, float("nan")]])
def test_a_window_kept_with_an_absurd_size_opens_no_larger_than_the_screen(
    open_window: Opener, tmp_path: Path, kept: list[float]
) -> None:
    (tmp_path / PREFERENCES_FILE).write_text(json.dumps({"window": kept}))
    window = open_window(None, kept_in=tmp_path).app.window
    _, _, width, height = glfw.get_monitor_workarea(glfw.get_primary_monitor())
    assert 200 <= window.size.width <= width
    assert 150 <= window.size.height <= height


def test_a_dropped_name_that_is_no_text_is_told_as_not_found(viewer: Driver) -> None:
    """As GLFW hands it over; its wrapper raises in the midst of the loop."""
    ((_, callback),) = glfw._window_drop_callback_repository.values()
    callback(viewer.app.window.handle, 1, (ctypes.c_char_p * 1)(b"/gone/\xff.png"))
    viewer.until(lambda app: any("no such file" in notice.text for notice in app.state.notices))


def test_views_come_nearest_first_to_where_the_user_looks(open_window: Opener, photo_path: Path) -> None:
    """From the hand to the worker: the viewpoint in a corner, the views made again."""
    driver = open_window(photo_path, grid=GridShape(9, 9))
    driver.until_idle()
    before = driver.app.state.scene
    driver.app.do(do(lens.move_eye, ViewOffset(-4.0, -4.0)), do(lens.set_depth_strength, 1.5, is_finished=True))
    driver.until(lambda app: app.state.scene is not before)
    arrived: list[tuple[int, int]] = []

    def is_done(app: App) -> bool:
        arrived.extend(sorted(app.state.views_there.difference(arrived)))
        return len(arrived) == 81

    driver.until(is_done)
    distances = [row + column for row, column in arrived]
    # The photo and the outer views come first, wherever the user looks.
    first, last = distances[9:45], distances[45:]
    assert sum(first) < 0.7 * sum(last)


def test_views_that_come_are_counted_now_and_then_not_each(
    open_window: Opener, photo_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("viewer.app.scene_loader.PROGRESS_S", math.inf)
    driver = open_window(photo_path, grid=GridShape(9, 9))
    driver.until(lambda app: app.scene_view.pictures_drawn > 0)
    frames, counted = driver.app.frames_shown, set[int]()

    def is_done(app: App) -> bool:
        counted.add(app.state.progress.done)
        return app.state.progress.is_complete and rests(app)

    driver.until(is_done)
    assert len(driver.app.state.views_there) == 81
    assert len(counted) == 2, "the photo, and all"
    assert driver.app.frames_shown - frames < 20
