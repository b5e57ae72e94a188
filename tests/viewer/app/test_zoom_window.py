"""Zoom and pan in a real window, by real mouse and key events."""

import numpy as np
import pytest

from iibr_core.exports.full_picture import FullPicture
from iibr_core.formats.images.photo import read_photo
from iibr_core.types import ViewOffset
from tests.viewer.conftest import says
from viewer.background.newest import Newest
from viewer.model import lens, viewpoint
from viewer.model.action import do
from viewer.model.layout import Zoom


def zoom_to(viewer, zoom):
    viewer.app.do(do(viewpoint.set_zoom, zoom))


def until_sharp(viewer):
    """Return the visible part from the photo's own pixels, once it is shown."""
    viewer.settle(lambda app: app.sharpener.pixels is not None)
    pixels = viewer.app.sharpener.pixels
    return pixels.astype(int)


@pytest.mark.usefixtures("wide_window")
def test_wheel_keys_and_middle_button_zoom_and_pull_the_picture(viewer):
    app, whole, optics = viewer.app, viewer.image().astype(int), viewer.app.state.optics
    x, y = viewer.position(0.25, 0.5)
    viewer.send("mousemove", x, y, "keydown", "ctrl", "click", 4, "click", 4, "click", 4, "keyup", "ctrl")
    viewer.settle(lambda app: app.layout().part.width < 0.8)
    part, frame = app.layout().part, app.layout().frame
    assert part.x + (x - frame.x) / frame.width * part.width == pytest.approx(0.25, abs=0.02)
    image = viewer.image().astype(int)
    rows = (part.y + (np.arange(image.shape[0]) + 0.5) / image.shape[0] * part.height) * whole.shape[0]
    columns = (part.x + (np.arange(image.shape[1]) + 0.5) / image.shape[1] * part.width) * whole.shape[1]
    difference = np.abs(image - whole[rows.astype(int)][:, columns.astype(int)])
    assert np.median(difference) <= 2, "it shows its part of the whole"
    viewer.send("mousemove", x, y, "mousedown", 2)
    app.step()
    viewer.send("mousemove", x - 40, y + 20)
    viewer.until(lambda app: app.layout().part.x > part.x)
    viewer.send("mouseup", 2, "key", "1")
    viewer.until(lambda app: app.layout().scale == 1.0)
    frame_px = app.layout().frame_px
    assert frame_px.size == (96, 64)
    viewer.key("0", until=lambda app: app.state.zoom is None)
    assert app.state.optics == optics, "nothing else was moved"


def test_at_rest_the_photos_own_pixels_are_seen_until_anything_moves(open_window, photo_path):
    viewer = open_window(photo_path, max_pixels=24 * 16).until_idle()
    app, photo = viewer.app, read_photo(photo_path).pixels * 255
    zoom_to(viewer, Zoom(1.0))
    sharp = until_sharp(viewer)
    assert sharp.shape == photo.shape
    assert np.abs(sharp - photo).max() <= 1
    assert np.abs(viewer.image().astype(int) - photo).mean() > 3, "the views hold less"
    app.do(do(viewpoint.move_camera, 0.2))
    viewer.settle(lambda app: app.free_camera_view.shown is not None)
    assert app.sharpener.pixels is None, "the photo's own pixels would hide what the camera sees"
    app.do(do(viewpoint.leave_camera))
    until_sharp(viewer)
    app.do(do(lens.move_eye, ViewOffset(0.0, 0.5)))
    viewer.until(lambda app: app.sharpener.pixels is None)
    assert np.abs(until_sharp(viewer) - viewer.image()).mean() < 12
    app.do(do(lens.set_aperture, 2.5))
    for zoom in (Zoom(1.0), Zoom(2.0, (0.4, 0.5))):  # the second part is made of the photo that the first part kept
        zoom_to(viewer, zoom)
        viewer.until(lambda app: app.sharpener.pixels is None)
        assert np.abs(until_sharp(viewer) - viewer.image()).mean() < 12, "blur stays"
    zoom_to(viewer, None)
    viewer.until(lambda app: app.sharpener.pixels is None)


def test_a_photo_that_is_gone_is_reported_once_and_the_views_stay(open_window, photo_path, monkeypatch):
    viewer = open_window(photo_path, max_pixels=24 * 16).until_idle()
    photo_path.unlink()
    zoom_to(viewer, Zoom(1.0))
    viewer.settle(says("full detail"))
    assert viewer.app.sharpener.pixels is None
    assert viewer.image().std() > 10
    asked = []
    monkeypatch.setattr(Newest, "submit", lambda _, request: asked.append(request))
    for place in ((0.3, 0.5), (0.6, 0.4)):
        zoom_to(viewer, Zoom(12.0, place))
        viewer.until_idle()
    assert not any(isinstance(request, FullPicture) for request in asked), "a pan does not try again"
