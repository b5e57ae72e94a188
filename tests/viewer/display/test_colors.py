"""Colours that sRGB lacks, from a photo's file to the screen: only the last step cuts them off."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image, ImageCms

from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.formats.images.write import write_image
from iibr_core.scenes.scene import Source
from iibr_core.types import DISPLAY_P3, SRGB, GridShape, ViewOffset
from tests.iibr_core.formats.test_color_profile import converted, profile_bytes
from viewer.app.picture_files import export_picture, shot_of
from viewer.display.offscreen import OffscreenScene
from viewer.gpu.inspection_passes import InspectionPasses
from viewer.model import lens
from viewer.model.action import do

PATCHES = ((200, 80, 60), (255, 0, 0), (0, 255, 0), (20, 30, 250), (128, 128, 128), (255, 255, 255))
IN_SRGB = converted(np.array([PATCHES], np.uint8), profile_bytes())[0].astype(float)
"""By littleCMS, from Display P3: the first is (216, 69, 50)."""
SIDE = 16


def photo_of_patches(path, **options):
    """Patches side by side."""
    row = np.repeat(np.array(PATCHES, np.uint8), SIDE, axis=0)
    Image.fromarray(np.repeat(row[None], SIDE, axis=0)).save(path, **options)
    return Source(str(path))


def middles(picture):
    """The colour in the middle of each patch."""
    return picture[SIDE // 2, SIDE // 2 :: SIDE].astype(float)


def test_wide_colours_keep_their_numbers_and_are_shown_as_srgb(tmp_path):
    with OffscreenScene() as viewer:
        viewer.open(photo_of_patches(tmp_path / "p3.png", icc_profile=profile_bytes()))
        viewer.do(do(lens.move_eye, ViewOffset(0.5, 0.25)), do(lens.set_aperture, 2.0))
        assert viewer.state.scene.color_space == DISPLAY_P3
        assert np.abs(middles(viewer.picture()) - IN_SRGB).max() <= 2
        assert np.abs(middles(viewer.picture(color_space=DISPLAY_P3)) - PATCHES).max() <= 1
        light = middles(viewer.picture(is_linear=True))
        assert light.min() < -0.01, "light that sRGB lacks is not cut off where nothing asks for it"
        passes = InspectionPasses(viewer.gl.ctx, viewer.view.renderer.programs)
        passes.draw_view(viewer.view.field, 0, 0, "stored", 1.0)
        assert np.abs(middles(passes.read("stored")[..., :3]) - IN_SRGB).max() <= 3
        passes.release()
        viewer.open(replace(viewer.scene.source, max_pixels=SIDE * SIDE))
        assert viewer.draws_own_pixels(viewer.scene.own_size)
        assert np.abs(middles(viewer.picture(viewer.scene.own_size, color_space=DISPLAY_P3)) - PATCHES).max() <= 1


@pytest.mark.parametrize(("name", "is_lost"), [("lamp.exr", False), ("lamp.png", True)])
def test_highlights_glow_where_the_photo_lost_them_and_stay_where_it_has_them(tmp_path, name, is_lost):
    """A lamp out of focus, in the views and at the photo's own size."""
    light, disparity = np.full((64, 96, 3), 0.1, np.float32), np.full((64, 96), -1.0, np.float32)
    light[24:32, 24:32], disparity[:, :48] = 4.0, 2.0
    write_image(tmp_path / name, light if name.endswith("exr") else (255 * np.minimum(light, 1)).astype(np.uint8))
    np.save(tmp_path / "lamp_disparity.npy", disparity)
    with OffscreenScene() as viewer:
        viewer.open(Source(str(tmp_path / name), grid=GridShape(3, 3), max_pixels=48 * 32))
        viewer.do(do(lens.set_aperture, 2.0), do(lens.set_focus, viewer.scene.disparity_range_px[0]))
        sizes = viewer.scene.size, viewer.scene.own_size
        before = [viewer.picture(size, is_linear=True) for size in sizes]
        viewer.do(do(lens.set_highlights, 1.0))
        for size, plain in zip(sizes, before):
            glowing = viewer.picture(size, is_linear=True)
            if is_lost:
                assert glowing.max() > 4 * plain.max()
            else:
                assert plain.max() > 1
                np.testing.assert_allclose(glowing, plain, rtol=0.02, atol=0.002)


@pytest.mark.parametrize(("name", "is_wide"), [("out.png", True), ("out.jpg", False)])
def test_saved_colours_are_those_of_the_photo(tmp_path, name, is_wide):
    """Seen by a reader that supports profiles, within 1 of 255."""
    options = {"icc_profile": profile_bytes()} if is_wide else {}
    source, out = photo_of_patches(tmp_path / "in.png", **options), tmp_path / name
    form = PictureFormat(bits=8, quality=100)
    with OffscreenScene() as viewer:
        viewer.open(source)
        shot = shot_of(viewer.state, viewer.state.scene.size, form)
        export_picture(out, viewer.picture(color_space=shot.color_space), shot)
    assert shot.color_space == (DISPLAY_P3 if is_wide else SRGB)
    with Image.open(out) as image:
        own = ImageCms.ImageCmsProfile(BytesIO(image.info["icc_profile"]))
        wanted = BytesIO(profile_bytes()) if is_wide else ImageCms.createProfile("sRGB")
        seen = ImageCms.profileToProfile(image, own, ImageCms.ImageCmsProfile(wanted))
    assert np.abs(middles(np.asarray(seen)) - PATCHES).max() <= 1
