"""The window's picture and panels without a window, under EGL."""

import numpy as np
import pytest

from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image
from iibr_core.runtime.work import watched
from iibr_core.scenes.scene import MAKING, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import HEIGHT, WIDTH
from viewer.display.offscreen import OffscreenScene
from viewer.model import inspection, lens
from viewer.model.action import do
from viewer.model.colormap import map_color


@pytest.fixture
def viewer(photo_path):
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(photo_path), grid=GridShape(3, 3)))
        yield viewer


def test_the_centre_view_is_the_photo_letterboxed_where_there_is_room(viewer, photo_path):
    picture, wide = viewer.picture(), viewer.picture((WIDTH + 40, HEIGHT))
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert np.abs(picture / 255 - read_photo(photo_path).pixels).max() < 2.5 / 255
    np.testing.assert_array_equal(wide[:, 20:-20], picture)
    assert (wide[:, :20] == wide[0, 0]).all()


@pytest.mark.parametrize("pixels", [np.zeros((1, 1, 3)), np.full((7, 1, 3), 128)])
def test_tiny_photos_open(tmp_path, viewer, pixels):
    write_image(tmp_path / "tiny.png", pixels.astype(np.uint8))
    viewer.open(Source(str(tmp_path / "tiny.png")))
    np.testing.assert_array_equal(viewer.picture(), pixels)
    viewer.do(do(inspection.set_overlay, "disparity"), do(inspection.set_opacity, 1.0))
    shown = viewer.screen(ScreenSize(800, 600))
    assert shown.shape == (600, 800, 3)
    assert shown[400, 244] == pytest.approx(np.multiply(map_color(0.5), 255), abs=2), "no depth is neither near nor far"


@pytest.mark.parametrize(
    ("actions", "views", "off"),
    [
        ((), 0, 0),
        ((do(lens.move_eye, ViewOffset(-1.5, 0.5)),), 4, 2),
        ((do(lens.set_aperture, 2.5), do(lens.set_focus_range, 0.2)), 20, 1),
        ((do(lens.set_dolly, 0.3),), 24, 0),
    ],
)
def test_only_the_views_that_a_picture_shows_are_made(viewer, photo_path, actions, views, off):
    """off: root mean square in 8-bit steps; what few views disocclude, or a lens blurs, is inpainted in fewer outer
    ones.
    """
    source, made = Source(str(photo_path), grid=GridShape(5, 5)), list[float]()

    def pictures_of(scene):
        viewer.do(*actions)
        return [viewer.state.optics]

    viewer.open(source)
    viewer.do(*actions)
    expected = viewer.picture()
    with watched(lambda done, total, doing: made.append(done / total) if doing == MAKING else None):
        viewer.open(source, pictures_of=pictures_of)
    difference = viewer.picture().astype(float) - expected
    assert np.sqrt((difference**2).mean()) <= off
    assert len(made) - 1 <= views
    assert made == sorted(made)
    assert made[-1] == pytest.approx(1.0)
