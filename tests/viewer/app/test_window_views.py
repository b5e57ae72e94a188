"""Ways of looking in a real window: the whole screen, before and after, inspection, gloss, a free camera."""

import threading

import numpy as np
import pytest
from imgui_bundle import imgui

from iibr_core.formats.images.photo import read_photo
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.viewer.conftest import SMALL_WINDOW
from viewer.app import saving
from viewer.model import lens, preferences
from viewer.model.action import do
from viewer.model.saving import SavePrompt
from viewer.model.tasks import SaveTask, ask
from viewer.model.viewpoint import FreeCamera
from viewer.ui.overlays.chips import CHIP

ROUNDING = 1
"""Largest difference between equal pictures that were drawn in other steps, of 255."""


def test_f11_fills_the_screen_and_tab_gives_the_panels_room_to_the_picture(viewer):
    place = viewer.app.state.preferences.window
    viewer.key("F11", settle=lambda app: app.window.is_fullscreen and app.window.size == (1400, 900))
    assert viewer.app.state.preferences.window == place, "a place to come back to"
    assert viewer.app.layout().panel.width == 0
    viewer.key("Escape", until=lambda app: not app.window.is_fullscreen and app.window.size == SMALL_WINDOW[2:])
    assert viewer.app.layout().panel.width > 0
    assert not viewer.app.state.should_quit
    viewer.until_idle()
    before = viewer.app.layout().picture
    viewer.key("Tab", settle=lambda app: app.layout().panel.width == 0)
    after = viewer.app.layout().picture
    assert after.width > 1.3 * before.width
    viewer.key("Tab", until=lambda app: app.layout().picture == before)


def test_before_is_the_photo_until_the_key_or_an_edit_ends_it(viewer):
    photo = viewer.image()
    viewer.do(do(lens.set_aperture, 3.0), do(lens.set_exposure, 1.0), do(lens.move_eye, ViewOffset(0, 1)))
    edited = viewer.image()
    viewer.key("backslash", settle=lambda app: app.state.shows_before)
    np.testing.assert_allclose(viewer.image().astype(int), photo, atol=ROUNDING)
    viewer.key("backslash", settle=lambda app: not app.state.shows_before)
    np.testing.assert_allclose(viewer.image().astype(int), edited, atol=ROUNDING)
    viewer.key("backslash", until=lambda app: app.state.shows_before)
    viewer.key("Right", until=lambda app: not app.state.shows_before)


def test_epis_follow_the_pointer_and_cost_no_picture(viewer):
    viewer.key("e", settle=lambda app: app.state.inspection.shows_epis)
    app = viewer.app
    assert app.layout().strip_across is not None
    shown = app.inspection_view.draw(app.state, app.layout())
    assert shown.strip_across is not None
    drawn, frames = app.scene_view.pictures_drawn, app.frames_shown
    viewer.send("mousemove", *viewer.position(0.5, 0.6))
    viewer.settle(lambda app: app.state.hover is not None and app.state.hover.y_px > 30)
    moved = app.inspection_view.draw(app.state, app.layout())
    assert moved != shown
    assert app.scene_view.pictures_drawn == drawn
    assert app.frames_shown > frames
    frames = app.frames_shown
    for _ in range(3):
        app.step()
    assert app.frames_shown == frames, "idle draws nothing"


def test_maps_and_values_come_and_tooltips_leave_a_dragged_slider_alone(viewer):
    sections = ("more", "view", "focus", "aperture", "light", "inspect")
    viewer.do(*(do(preferences.toggle_section, section) for section in sections))
    viewer.press("Values", until=lambda app: app.layout().status is not None)
    viewer.press("Entropy", until=lambda app: app.inspection_view.draw(app.state, app.layout()).overlay is not None)
    viewer.find("##Opacity")
    viewer.send("mousedown", 1)
    viewer.until(lambda app: imgui.is_any_item_active())
    viewer.app.step()
    tip = imgui.internal.find_window_by_name("##Tooltip_00")
    assert tip is None or not tip.active, "the picture is what matters while a slider is dragged"
    viewer.send("mouseup", 1, "mousemove", *viewer.position(0.5, 0.5))
    viewer.until(lambda app: app.state.inspection.probe is not None)
    assert viewer.app.state.inspection.probe.origin == "photo"
    viewer.send("mousemove", round(viewer.app.layout().panel.x + 30), 500)
    viewer.until(lambda app: app.state.inspection.probe is None)


def make_glossy(driver):
    """Switch gloss on, and wait until it is seen: what it means is found out beside the window."""
    driver.open_sections("gloss")
    driver.press("Glossy surface", until=lambda app: app.state.optics.gloss is not None)
    driver.settle(lambda app: app.scene_view.gloss_request(app.state.optics.gloss) is None)


def test_a_surface_is_made_glossy_its_light_dragged_and_both_taken_back(viewer):
    plain = viewer.image()
    make_glossy(viewer)
    shiny = viewer.image()
    assert np.abs(shiny.astype(int) - plain).max() > 3
    previews = viewer.app.scene_view.previews
    x, y = viewer.find("light ball")
    viewer.drag((x, y), (x + 300, y + 300), until=lambda app: min(app.state.optics.gloss.light.direction[:2]) > 0.3)
    assert not np.array_equal(viewer.image(), shiny)
    assert viewer.app.scene_view.previews == previews, "the light needs no new maps"
    viewer.send("key", "ctrl+z")
    viewer.key("ctrl+z", settle=lambda app: app.state.optics.gloss is None)
    assert np.array_equal(viewer.image(), plain)


def seen(viewer):
    """What the free camera sees, once that is shown."""
    viewer.until(
        lambda app: (
            app.free_camera_view.shown is not None and app.free_camera_view.shown.camera == app.state.free_camera
        )
    )
    viewer.until_idle()
    return viewer.image().astype(int)


def red_places(pixels):
    """(N, 2): x and y of the near square, as shares of the picture."""
    y, x = np.nonzero(pixels[..., 0] > pixels[..., 1] + 60)
    return np.stack([x / pixels.shape[1], y / pixels.shape[0]], axis=-1)


def test_the_camera_steps_forward_looks_aside_and_goes_back(viewer):
    before = viewer.image()
    viewer.send("key", "w", "key", "w")
    viewer.until(lambda app: app.state.free_camera == FreeCamera(forward=0.1))
    near = viewer.app.scene_view.pick(ViewOffset(0, 0), 48, 32)
    assert np.ptp(red_places(seen(viewer))[:, 0]) == pytest.approx(1 / 3 / 0.9, abs=0.02)
    assert near < viewer.app.scene_view.pick(ViewOffset(0, 0), 48, 32) < near + 1, "it is nearer, for the lens too"
    viewer.send("key", "s", "key", "s", "key", "shift+d", "key", "shift+d")
    viewer.until(lambda app: app.state.free_camera == FreeCamera(right=0.1))
    assert red_places(seen(viewer))[:, 0].mean() == pytest.approx(0.45, abs=0.02)
    viewer.press("###leave", CHIP)
    viewer.settle(lambda app: app.state.free_camera is None and app.free_camera_view.shown is None)
    assert viewer.app.state.optics.focus_disparity == 0, "nothing behind the chip was clicked"
    np.testing.assert_array_equal(viewer.image(), before)


def test_pictures_that_wait_show_what_the_camera_saw(viewer, tmp_path, monkeypatch):
    """Each of its own camera, however far that has moved when its turn comes."""
    app, paths = viewer.app, [tmp_path / f"{k}.png" for k in range(2)]
    held, export = threading.Event(), saving.export_picture

    def export_when_held(*arguments):
        assert held.wait(60)
        return export(*arguments)

    monkeypatch.setattr(saving, "export_picture", export_when_held)
    viewer.send("key", "w")
    sharp = seen(viewer)
    app.do(do(lens.set_aperture, 3.0))
    assert np.abs(seen(viewer) - sharp).mean() > 1.0, "the lens blurs what the camera sees"
    app.do(do(lens.set_aperture, 0.0))
    expected = []
    for path in paths:
        viewer.send("key", "w")
        before = app.state.free_camera
        viewer.until(lambda app, before=before: app.state.free_camera != before)
        expected.append(seen(viewer))
        app.do(do(ask, SaveTask(SavePrompt(str(path), ScreenSize(expected[-1].shape[1], expected[-1].shape[0])))))
        viewer.until(lambda app: not app.state.tasks)
    held.set()
    viewer.until(lambda app: not app.state.jobs)
    for path, image in zip(paths, expected):
        np.testing.assert_allclose(255 * read_photo(path).pixels, image, atol=1.01)
    assert not np.array_equal(expected[0], expected[1])
