"""Zoom and pan in a real window, by real mouse and key events."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from iibr_core.types import GridShape
from tests.viewer.conftest import NEAR, Driver
from viewer.model.layout import Rect
from viewer.model.zoom import SetZoom, Zoom

Opener = Callable[..., Driver]


@pytest.fixture
def viewer(open_window: Opener, photo_path: Path) -> Driver:
    driver = open_window(photo_path, grid=GridShape(3, 3))
    driver.until_idle()
    return driver


def part_of(viewer: Driver) -> Rect:
    return viewer.app.layout().part


def test_ctrl_and_wheel_zoom_about_the_pointer_and_the_keys_say_how_large(viewer: Driver) -> None:
    focus = viewer.app.state.optics.focus_disparity
    x, y = viewer.position(0.25, 0.5)
    viewer.send("mousemove", x, y, "keydown", "ctrl", "click", 4, "click", 4, "click", 4, "keyup", "ctrl")
    viewer.until(lambda app: app.layout().part.width < 0.8)
    viewer.until_idle()
    part, frame = part_of(viewer), viewer.app.layout().frame
    assert frame is not None
    assert part.x + (x - frame.x) / frame.width * part.width == pytest.approx(0.25, abs=0.02)
    assert viewer.app.state.optics.focus_disparity == focus
    viewer.send("key", "1")
    viewer.until(lambda app: app.layout().scale == 1.0)
    frame_px = viewer.app.layout().frame_px
    assert frame_px is not None
    assert frame_px.size == (96, 64)
    viewer.send("key", "0")
    viewer.until(lambda app: app.state.zoom is None)


def test_a_zoomed_picture_is_its_part_of_the_whole(viewer: Driver) -> None:
    """Twice as large, its middle is what the middle half of the whole shows."""
    whole = viewer.image().astype(int)
    fit = viewer.app.layout().fit
    viewer.app.do(SetZoom(Zoom(2 * fit)))
    viewer.until_idle()
    image, part = viewer.image().astype(int), part_of(viewer)
    height, width = image.shape[:2]
    rows = (part.y + (np.arange(height) + 0.5) / height * part.height) * whole.shape[0]
    columns = (part.x + (np.arange(width) + 0.5) / width * part.width) * whole.shape[1]
    expected = whole[rows.astype(int)][:, columns.astype(int)]
    assert np.median(np.abs(image - expected)) <= 2
    assert np.abs(image - expected).mean() < 6


def test_the_middle_button_and_space_pull_the_picture(viewer: Driver) -> None:
    app = viewer.app
    app.do(SetZoom(Zoom(3 * app.layout().fit)))
    viewer.until_idle()
    eye, is_paused, frame = app.state.optics.eye, app.state.motion.is_paused, app.layout().frame
    assert frame is not None
    x, y = round(frame.x + frame.width / 2), round(frame.y + frame.height / 2)
    before = part_of(viewer)
    viewer.send("mousemove", x, y, "mousedown", 2)
    app.step()
    viewer.send("mousemove", x - 40, y + 20)
    viewer.until(lambda app: app.layout().part.x > before.x and app.layout().part.y < before.y)
    viewer.send("mouseup", 2)
    viewer.until_idle()
    pulled = part_of(viewer)
    viewer.send("mousemove", x, y, "keydown", "space")
    app.step()
    viewer.send("mousedown", 1)
    app.step()
    viewer.send("mousemove", x + 30, y)
    viewer.until(lambda app: app.layout().part.x < pulled.x)
    viewer.send("mouseup", 1, "keyup", "space")
    viewer.until_idle()
    assert app.state.optics.eye == eye
    assert app.state.motion.is_paused == is_paused
    viewer.send("key", "space")
    viewer.until(lambda app: app.state.motion.is_paused != is_paused)


def test_a_click_in_the_zoomed_picture_focuses_on_what_is_seen_there(viewer: Driver) -> None:
    app = viewer.app
    scene = app.state.scene
    assert scene is not None
    assert scene.plan is not None
    app.do(SetZoom(Zoom(4 * app.layout().fit, (0.5, 0.5))))
    viewer.until_idle()
    frame = app.layout().frame
    assert frame is not None
    # At the left border of the frame: unzoomed, the far wall would be there.
    viewer.send("mousemove", round(frame.x + 0.1 * frame.width), round(frame.y + frame.height / 2), "click", 1)
    near = (NEAR - scene.plan.disparity_zero) * scene.plan.disparity_scale
    viewer.until(lambda app: app.state.optics.focus_disparity == pytest.approx(near, abs=0.2))
