"""Pictures at the photo's own size against the same pictures from views as large as the photo."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.formats.images.write import write_image
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from viewer.display.offscreen import OffscreenScene

SIZE = ScreenSize(300, 200)
SMALLER = 120 * 80
MIN_DB = 40.0
LENSES = {
    "pinhole": Optics(ViewOffset(0.6, -0.4)),
    "wide, beside the middle": Optics(ViewOffset(-0.5, 0.3), focus_disparity=-0.5, aperture_diameter=2.5),
    "tilt": Optics(aperture_diameter=2.5, focus_tilt=(1.2, -0.4)),
    "highlights through a cat's-eye": Optics(
        aperture_diameter=2.0,
        focus_disparity=0.8,
        highlight_recovery=1.0,
        exposure_stops=-1.0,
        aperture_shape=ApertureShape("cat_eye", cat_eye=1.0),
    ),
}
"""Disparities as shares of the scene's greatest."""


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    """A textured disc before a slanted wall, with a bright dot."""
    folder, random = tmp_path_factory.mktemp("full"), np.random.default_rng(2)
    noise = np.stack([gaussian_filter(random.random(SIZE[::-1]), 1.5) for _ in range(3)], axis=-1)
    pixels = np.clip(0.5 + 3 * (noise - 0.5), 0, 1)
    y, x = np.indices(SIZE[::-1])
    disparity = (-1.0 + x / SIZE.width).astype(np.float32)
    disc = np.hypot(y - 100, x - 130) < 50
    pixels[disc], disparity[disc] = pixels[disc] * (0.5, 0.8, 1.0), 1.5
    pixels[20:24, 240:244] = 1.0
    write_image(folder / "photo.png", np.rint(255 * pixels).astype(np.uint8))
    np.save(folder / "photo_disparity.npy", disparity)
    return folder / "photo.png"


@pytest.fixture(scope="module")
def viewers(photo):
    """The photo opened smaller, and at its own size."""
    with OffscreenScene("egl") as smaller, OffscreenScene("egl") as own:
        for viewer, max_pixels in ((smaller, SMALLER), (own, 10**6)):
            viewer.open(Source(str(photo), grid=GridShape(5, 5), max_pixels=max_pixels))
        yield smaller, own


def picture(viewer, optics):
    greatest = max(map(abs, viewer.scene.disparity_range_px))
    viewer.state = replace(viewer.state, optics=optics.with_focus_scaled(greatest))
    return np.asarray(viewer.picture(SIZE), np.float32) / 255


@pytest.mark.parametrize("name", LENSES)
def test_a_picture_at_the_photos_own_size_is_that_of_views_so_large(viewers, name):
    optics = LENSES[name]
    full, expected = (picture(viewer, optics)[8:-8, 8:-8] for viewer in viewers)
    assert [viewer.draws_own_pixels(SIZE) for viewer in viewers] == [True, False]
    assert bounded_psnr(full, expected) > MIN_DB


def test_tiles_are_as_sharp_as_the_whole(viewers, monkeypatch):
    optics = LENSES["tilt"]
    at_once = picture(viewers[0], optics)
    monkeypatch.setattr("iibr_core.exports.full_drawing.TILE_PX", 64)
    tiled = picture(viewers[0], optics)
    assert bounded_psnr(tiled, at_once) > MIN_DB
    steps = [np.abs(np.diff(image, axis=1)).mean(axis=(0, 2)) for image in (tiled, at_once)]
    for left in range(0, SIZE.width - 64, 64):
        tile = slice(left, left + 63)
        assert steps[0][tile].mean() == pytest.approx(steps[1][tile].mean(), rel=0.05), "one tile is as sharp as all"
