"""A camera that leaves the plane of the views, in a real window, by real key events."""

import threading

import numpy as np
import pytest

from iibr_core.formats.images.photo import read_photo
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from viewer.app import saving
from viewer.model import lens
from viewer.model.action import do
from viewer.model.saving import SavePrompt
from viewer.model.tasks import SaveTask, ask
from viewer.model.viewpoint import FreeCamera
from viewer.ui.overlays.chips import CHIP


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
