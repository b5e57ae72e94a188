import numpy as np
import OpenImageIO as oiio
import pytest
from scipy.ndimage import binary_erosion

from iibr_core.beyond.optics import Optics
from iibr_core.color import convert, srgb_from_linear
from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.full_drawing import draw_full
from iibr_core.exports.full_picture import FullPicture, encode_light, is_full
from iibr_core.exports.kinds import ExportOptions, export_kind
from iibr_core.exports.source import open_for_export
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import DISPLAY_P3, SRGB, GridShape
from tests.iibr_core.exports.conftest import exported
from tests.viewer.conftest import write_scene


def values_of(path):
    image = oiio.ImageInput.open(str(path))
    spec = image.spec()
    return np.asarray(image.read_image(format=spec.format))[..., 0], str(spec.format), spec.nchannels


@pytest.mark.parametrize("aperture", [0.0, 2.0])
def test_what_lies_behind_is_drawn_at_the_photos_own_size_where_the_lens_is_open(tmp_path, aperture):
    kind, tiles = export_kind("blur"), []
    given = Source(str(write_scene(tmp_path)), DepthChoice(refine=False), GridShape(3, 3), max_pixels=96 * 64 // 4)
    opened = open_for_export(kind, ExportOptions(), given, 1.0, LensChoice(), lambda scene: None, None)

    def draw(settings):
        tiles.append(settings.tile)
        return np.zeros((settings.size_px.height, settings.size_px.width, 3), np.float32)

    optics, size = Optics(aperture_diameter=aperture), ScreenSize(96, 64)
    assert is_full(opened.scene, optics, size)
    draw_full(FullPicture(opened.scene, opened.plan(), opened.loaded, optics, size), draw)
    assert [tile.hidden is not None for tile in tiles] == [aperture > 0]


def test_light_is_brought_to_the_colours_of_a_file():
    light = np.random.default_rng(0).uniform(0.2, 0.8, (5, 6, 3)).astype(np.float32)
    assert np.array_equal(encode_light(light, True, DISPLAY_P3, DISPLAY_P3), light)
    expected = convert(srgb_from_linear(light), SRGB, DISPLAY_P3)
    np.testing.assert_allclose(encode_light(light, False, SRGB, DISPLAY_P3), 255 * expected, atol=0.51)


def test_the_matte_is_the_surface_that_was_picked(source, tmp_path):
    disparity = source.centre_view().disparity
    is_near = disparity == disparity.max()
    y, x = (int(np.mean(places)) for places in np.nonzero(is_near))
    near, kind, _ = values_of(exported(source, "matte", tmp_path / "near.png", at=(x + 0.5, y + 0.5)))
    wall, *_ = values_of(exported(source, "matte", tmp_path / "wall.png", at=(0, 0)))
    assert kind == "uint16"
    inner = binary_erosion(is_near, iterations=5)
    assert near[inner].min() > 65000
    assert wall[inner].max() < 500
    assert wall[0, 0] > 65000
    assert np.abs(near / 65535 - is_near).mean() < 0.02
