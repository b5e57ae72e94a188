import numpy as np
import OpenImageIO as oiio
import pytest
from scipy.ndimage import binary_erosion

from iibr_core.beyond.lens_slices import slices_of
from iibr_core.beyond.optics import Optics
from iibr_core.color import convert, srgb_from_linear
from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.full_drawing import draw_full
from iibr_core.exports.full_picture import FullPicture, encode_light, is_full
from iibr_core.exports.kinds import ExportOptions, export_kind
from iibr_core.exports.source import open_for_export, write_export
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import DISPLAY_P3, SRGB, GridShape, InputError
from tests.iibr_core.exports.conftest import exported
from tests.viewer.conftest import write_scene


def values_of(path):
    image = oiio.ImageInput.open(str(path))
    spec = image.spec()
    return np.asarray(image.read_image(format=spec.format))[..., 0], str(spec.format), spec.nchannels


def test_the_defocus_map_holds_signed_radii_of_the_discs_that_are_drawn(source, tmp_path):
    disparity = source.centre_view().disparity
    far, near = float(disparity.min()), float(disparity.max())
    optics = {"aperture_diameter": 5.0, "focus_disparity": near - 0.25 * (near - far), "focus_range": 0.1}
    radius, kind, channels = values_of(exported(source, "blur", tmp_path / "a.exr", optics))
    assert (kind, channels, radius.shape) == ("float", 1, disparity.shape)
    discs = 5.0 * np.array([near - optics["focus_disparity"] - 0.1, far - optics["focus_disparity"] + 0.1])
    assert discs[0] > 0 > discs[1], "positive before the focus"
    np.testing.assert_allclose([radius.max(), radius.min()], discs / 2, rtol=1e-5)
    drawn = [each.diameter_px for each in slices_of(2 * radius.astype(np.float64), source.optics.aperture_shape)]
    np.testing.assert_allclose((drawn[0], drawn[-1]), discs, rtol=0.1)
    with pytest.raises(InputError, match="a closed lens blurs nothing"):
        exported(source, "blur", tmp_path / "b.exr")


def test_maps_are_as_large_as_the_photo_where_views_are_smaller(tmp_path):
    photo, maps = write_scene(tmp_path), []
    for max_pixels in (None, 96 * 64 // 4):
        lens, kind = LensChoice(aperture=4.0, focus=0.0), export_kind("blur")
        given = Source(str(photo), DepthChoice(refine=False), GridShape(3, 3), max_pixels=max_pixels)
        opened = open_for_export(kind, ExportOptions(), given, 1.0, lens, lambda scene: None, None)
        write_export(kind, tmp_path / f"{max_pixels}.exr", opened, ExportOptions())
        maps.append(values_of(tmp_path / f"{max_pixels}.exr")[0])
    own, reduced = maps
    assert own.shape == reduced.shape == (64, 96)
    assert np.abs(own - reduced).mean() < 0.1 * np.ptp(own)
    assert np.ptp(reduced) == pytest.approx(np.ptp(own), rel=0.1)


def test_a_tilted_lens_has_its_focus_elsewhere_at_each_border(source, tmp_path):
    disparity = source.centre_view().disparity
    optics = {"aperture_diameter": 2.0, "focus_tilt": (0.5, 0.0)}
    radius = values_of(exported(source, "blur", tmp_path / "a.exr", optics))[0]
    np.testing.assert_allclose((disparity - radius)[0, [0, -1]], [-0.5, 0.5], atol=0.01)


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


@pytest.mark.parametrize("ending", [".png", ".tif"])
def test_the_mask_is_white_in_focus_and_fades_at_both_ends(source, tmp_path, ending):
    disparity = source.centre_view().disparity
    far, near = float(disparity.min()), float(disparity.max())
    span = near - far

    def at_far_and_near(soft):
        optics = {"focus_disparity": near, "focus_range": 0.25 * span}
        name = tmp_path / f"{soft}{ending}"
        mask, kind, channels = values_of(exported(source, "depth-mask", name, optics, soft=soft))
        assert (kind, channels) == ("uint16", 1)
        return mask[disparity == far].max(), mask[disparity == near].min()

    assert at_far_and_near(0.5 * span) == (0, 65535)
    shade, white = at_far_and_near(1.5 * span)
    assert (white, abs(int(shade) - 65535 // 2) < 3) == (65535, True), "half of a smooth step"


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
    for place, problem in (((96, 0), "lies outside the picture"), (None, "which surface")):
        with pytest.raises(InputError, match=problem):
            exported(source, "matte", tmp_path / "b.png", at=place)
