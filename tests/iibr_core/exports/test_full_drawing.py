"""Pictures drawn from the photo at its own size, compared with the photo and with `tests/golden/full`."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond.optics import ApertureMask, ApertureShape, Optics
from iibr_core.color import convert, srgb_from_linear
from iibr_core.exports import full_drawing
from iibr_core.exports.full_drawing import draw_full, draw_picture
from iibr_core.exports.full_picture import FullPicture, encode_light, is_full
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import DISPLAY_P3, SRGB, ViewOffset
from tests.iibr_core.facts import colors, require_golden, spread
from tests.iibr_core.hard_scenes import photo_colors

OWN = ScreenSize(96, 64)
CROSS = ApertureShape("mask", rotation_deg=30.0, mask=ApertureMask("cross", 2, 2, bytes([255, 0, 40, 255])))
PICTURES: dict[str, tuple[Optics, ScreenSize, Rect]] = {
    "part": (Optics(), ScreenSize(36, 24), Rect(0.52, 0.13, 0.375, 0.375)),
    "smaller": (Optics(eye=ViewOffset(-0.5, 1.0)), ScreenSize(70, 60), WHOLE),
    "aside": (Optics(eye=ViewOffset(-1.0, -2.0)), OWN, WHOLE),
    "near": (Optics(aperture_diameter=4.0, focus_disparity=1.2, highlight_recovery=0.4), OWN, WHOLE),
    "tilted": (Optics(aperture_diameter=4.0, focus_tilt=(1.5, -0.6), focus_range=0.2), OWN, WHOLE),
    "mask": (Optics(ViewOffset(0.0, 1.0), aperture_diameter=5.0, aperture_shape=CROSS), OWN, Rect(0.3, 0, 0.7, 0.8)),
}


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_drawn_as_before_however_they_are_cut_into_tiles(hard, monkeypatch, name, regenerate_golden):
    source, (optics, size, part) = hard["photo"], PICTURES[name]
    picture = FullPicture(source.scene, source.plan(), source.loaded, optics, size, part)
    light = draw_full(picture, source.draw)
    shown = np.rint(255 * np.clip(srgb_from_linear(light), 0, 1))
    require_golden({"light": spread(light), "colors": colors(shown)}, "full", name, 3, regenerate_golden)
    monkeypatch.setattr(full_drawing, "TILE_PX", 40)
    in_tiles = np.rint(255 * np.clip(srgb_from_linear(draw_full(picture, source.draw)), 0, 1))
    assert np.abs(in_tiles - shown).mean() < 0.3
    assert np.abs(in_tiles - shown).max() < 12


def test_as_taken_the_picture_is_the_photo(hard):
    source = hard["photo"]
    settings = RenderSettings(Optics(), OWN, color_space=DISPLAY_P3)
    drawn = draw_picture(source.scene, source.loaded, settings, source.draw)
    assert np.abs(drawn.astype(int) - photo_colors()).max() <= 1
    linear = draw_picture(source.scene, source.loaded, replace(settings, is_linear=True), source.draw)
    assert np.abs(255 * srgb_from_linear(linear) - photo_colors()).max() < 1


def test_the_photo_is_drawn_from_where_it_shows_more_than_its_views(hard):
    scene, views = hard["photo"].scene, ScreenSize(48, 32)
    assert is_full(scene, Optics(aperture_diameter=2.0), OWN)
    others = (
        (scene, Optics(), views), (replace(scene, own_size=views), Optics(), OWN), (scene, Optics(dolly=0.5), OWN),
        (scene, Optics(gloss=Gloss()), OWN), (replace(scene, plan=None), Optics(), OWN),
        (replace(scene, own_size=None), Optics(), OWN),
    )  # fmt: skip
    assert not any(is_full(*other) for other in others)


def test_light_is_brought_to_the_colours_of_a_file():
    light = np.random.default_rng(0).uniform(0.2, 0.8, (5, 6, 3)).astype(np.float32)
    assert np.array_equal(encode_light(light, True, DISPLAY_P3, DISPLAY_P3), light)
    expected = convert(srgb_from_linear(light), SRGB, DISPLAY_P3)
    np.testing.assert_allclose(encode_light(light, False, SRGB, DISPLAY_P3), 255 * expected, atol=0.51)
