"""Zoom and pan in a real window, by real mouse and key events."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.photo import read_photo
from iibr_core.scenes.rect import Rect
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import NEAR, Driver, Opener
from viewer.model import lens, viewpoint
from viewer.model.action import do
from viewer.model.state.viewpoint import Zoom


def until_sharp(viewer: Driver) -> np.ndarray:
    """The part that is seen, from the photo's own pixels, once it is shown."""
    viewer.until(lambda app: app.sharpener.pixels is not None)
    viewer.until_idle()
    pixels = viewer.app.sharpener.pixels
    assert pixels is not None
    return pixels.astype(int)


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
    viewer.app.do(do(viewpoint.set_zoom, Zoom(2 * fit)))
    viewer.until_idle()
    image, part = viewer.image().astype(int), part_of(viewer)
    height, width = image.shape[:2]
    rows = (part.y + (np.arange(height) + 0.5) / height * part.height) * whole.shape[0]
    columns = (part.x + (np.arange(width) + 0.5) / width * part.width) * whole.shape[1]
    expected = whole[rows.astype(int)][:, columns.astype(int)]
    assert np.median(np.abs(image - expected)) <= 2
    assert np.abs(image - expected).mean() < 6


@pytest.mark.usefixtures("wide_window")
def test_the_middle_button_pulls_the_picture(viewer: Driver) -> None:
    app = viewer.app
    app.do(do(viewpoint.set_zoom, Zoom(3 * app.layout().fit)))
    viewer.until_idle()
    eye, frame = app.state.optics.eye, app.layout().frame
    assert frame is not None
    x, y = round(frame.x + frame.width / 2), round(frame.y + frame.height / 2)
    before = part_of(viewer)
    viewer.send("mousemove", x, y, "mousedown", 2)
    app.step()
    viewer.send("mousemove", x - 40, y + 20)
    viewer.until(lambda app: app.layout().part.x > before.x and app.layout().part.y < before.y)
    viewer.send("mouseup", 2)
    viewer.until_idle()
    assert app.state.optics.eye == eye


def test_a_click_in_the_zoomed_picture_focuses_on_what_is_seen_there(viewer: Driver) -> None:
    app = viewer.app
    scene = app.state.scene
    assert scene is not None
    assert scene.plan is not None
    app.do(do(viewpoint.set_zoom, Zoom(4 * app.layout().fit, (0.5, 0.5))))
    viewer.until_idle()
    frame = app.layout().frame
    assert frame is not None
    # At the left border of the frame: unzoomed, the far wall would be there.
    viewer.send("mousemove", round(frame.x + 0.1 * frame.width), round(frame.y + frame.height / 2), "click", 1)
    near = (NEAR - scene.plan.disparity_zero) * scene.plan.disparity_scale
    viewer.until(lambda app: app.state.optics.focus_disparity == pytest.approx(near, abs=0.2))


def test_at_rest_the_photos_own_pixels_are_seen_until_anything_moves(open_window: Opener, photo_path: Path) -> None:
    viewer = open_window(photo_path, grid=GridShape(3, 3), max_pixels=24 * 16)
    viewer.until_idle()
    app, photo = viewer.app, read_photo(photo_path).pixels * 255
    app.do(do(viewpoint.set_zoom, Zoom(1.0)))
    sharp = until_sharp(viewer)
    assert sharp.shape == photo.shape
    assert np.abs(sharp - photo).max() <= 1
    assert np.abs(viewer.image().astype(int) - photo).mean() > 3  # the views hold less
    app.do(do(viewpoint.set_zoom, Zoom(2.0, (0.3, 0.6))))
    viewer.until(lambda app: app.layout().scale == 2.0 and app.sharpener.pixels is not None)
    app.do(do(lens.move_eye, ViewOffset(0.0, 0.5)))
    viewer.until(lambda app: app.sharpener.pixels is None)
    moved = until_sharp(viewer)
    assert np.abs(moved - viewer.image()).mean() < 12
    app.do(do(viewpoint.set_zoom, None))
    viewer.until(lambda app: app.sharpener.pixels is None)


def test_what_is_blurred_stays_so_where_it_is_sharpened(open_window: Opener, photo_path: Path) -> None:
    viewer = open_window(photo_path, grid=GridShape(3, 3), max_pixels=24 * 16)
    viewer.until_idle()
    for zoom in (Zoom(1.0), Zoom(2.0, (0.4, 0.5))):  # the second is made of what the first was
        viewer.app.do(do(lens.set_aperture, 2.5), do(viewpoint.set_zoom, zoom))
        viewer.until(lambda app: app.sharpener.pixels is None)
        sharp = until_sharp(viewer)
        assert np.abs(sharp - viewer.image()).mean() < 12


def test_a_photo_that_is_gone_is_said_and_the_views_are_seen_on(open_window: Opener, photo_path: Path) -> None:
    viewer = open_window(photo_path, grid=GridShape(3, 3), max_pixels=24 * 16)
    viewer.until_idle()
    photo_path.unlink()
    viewer.app.do(do(viewpoint.set_zoom, Zoom(1.0)))
    viewer.until(lambda app: any("full detail" in notice.text for notice in app.state.notices))
    viewer.until_idle()
    assert viewer.app.sharpener.pixels is None
    assert viewer.image().std() > 10
