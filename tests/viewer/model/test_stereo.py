"""The stereo picture: viewpoints of the eyes, parallax on the screen, arrangements, and the choice of a monitor."""

from dataclasses import replace

import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.exports.framing import side_pictures
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.model.scene_stories import LENTICULAR
from viewer.model import stereo
from viewer.model.app_state import AppState
from viewer.model.stereo import STEREO_MODES, Monitor, Stereo

SCENE = Scene(Source("a.png"), "a", 600, 400, GridShape(3, 9), (-2.0, 4.0), "a.pfm")
PANEL, TELEVISION = Monitor("eDP-1", 0, 0, 1920, 1080), Monitor("HDMI-1", 1920, 0, 3840, 2160)
STATE = AppState(scene=SCENE, monitors=(PANEL, TELEVISION))


def test_the_eyes_see_what_an_export_of_both_shows():
    chosen = Stereo(eyes=3.0, screen=1.5)
    eyes = stereo.eyes_at(SCENE, Optics(aperture_diameter=2.0), chosen)
    wanted = side_pictures(SCENE, RenderSettings(Optics(focus_disparity=1.5), ScreenSize(60, 40)), 2, 3.0)
    assert [eye.optics.eye for eye in eyes] == [each.optics.eye for each in wanted]
    for eye, picture in zip(eyes, wanted, strict=True):
        assert eye.part == pytest.approx(picture.part)
    assert {eye.optics.aperture_diameter for eye in eyes} == {2.0}


@pytest.mark.parametrize("count", [2, 45])
@pytest.mark.parametrize("at", [-4.0, 0.3, 3.9, 99.0])
def test_all_eyes_stay_within_the_views_and_the_picture(at, count):
    eyes = stereo.eyes_at(SCENE, Optics(eye=ViewOffset(0.5, at)), Stereo(eyes=2.0, screen=4.0), count)
    places = [eye.optics.eye.s for eye in eyes]
    assert len(places) == count
    assert places == sorted(places)
    assert min(places) >= -4
    assert max(places) <= 4
    assert places[-1] - places[0] == pytest.approx(2.0)
    assert all(eye.part.x >= -1e-9 and eye.part.x + eye.part.width <= 1 + 1e-9 for eye in eyes)
    # what lies in the plane of the screen stays in place: its disparity times the step, less the shear
    assert {round(-4.0 * eye.optics.eye.s / 600 - eye.part.x, 9) for eye in eyes} == {
        round(-4.0 * places[0] / 600 - eyes[0].part.x, 9)
    }


def test_a_comfortable_eye_distance_is_found_and_more_is_warned_of():
    usual = Stereo()
    assert stereo.eye_distance(SCENE, usual) == pytest.approx(0.03 * 600 / 4)
    assert stereo.eye_distance(SCENE, replace(usual, screen=4.0)) == pytest.approx(0.03 * 600 / (6 + 0.03 * 4))
    assert [stereo.warning(SCENE, replace(usual, screen=plane)) for plane in (-2.0, 0.0, 1.0, 4.0)] == [""] * 4
    wide = replace(usual, eyes=8.0)
    assert stereo.warning(SCENE, wide).startswith("Parallax before the screen is 5.3 % of the width")  # 4 * 8 / 600
    behind = stereo.warning(SCENE, replace(wide, screen=4.0))  # 6 * 8 / 600, of the width that the shear leaves
    assert behind.startswith(f"Parallax behind the screen is {100 * 6 * 8 / (600 - 4 * 8):.1f} % of the width")
    assert stereo.eye_distance(SCENE, replace(usual, eyes=100.0)) == 8.0
    flat = replace(SCENE, grid=GridShape(1, 1), disparity_range_px=(0.0, 0.0))
    assert stereo.eye_distance(flat, usual) == 1.0
    assert stereo.warning(flat, usual) == ""


@pytest.mark.parametrize("mode", STEREO_MODES)
@pytest.mark.parametrize("size", [ScreenSize(1920, 1080), ScreenSize(641, 3), ScreenSize(1, 1)])
def test_pictures_fit_their_rooms_and_places_lead_back(mode, size):
    state = stereo.set_mode(STATE, mode)
    weave = stereo.weave_of(state, SCENE, size)
    assert all(1 <= inner <= room <= whole for inner, room, whole in zip(weave.eyes[0].size_px, weave.frame_px, size))
    assert (weave.eyes[0].optics.eye.s > weave.eyes[1].optics.eye.s) == (mode == "cross-eyed")
    middle = stereo.place_in_photo(weave, weave.frame_px.width / 2, weave.frame_px.height / 2)
    assert middle == pytest.approx((0.5, 0.5), abs=0.51 / min(weave.eyes[0].size_px))
    assert stereo.place_in_photo(weave, 0, 0) == pytest.approx((0, 0), abs=1e-9)


@pytest.mark.parametrize("mode", ["sbs", "cross-eyed"])
def test_a_lenticular_display_shows_its_views_from_left_to_right_whatever_the_eyes(mode):
    shown = replace(stereo.set_mode(STATE, mode), stereo=Stereo(display=LENTICULAR))
    for state in (shown, stereo.swap_eyes(shown)):
        places = [eye.optics.eye.s for eye in stereo.weave_of(state, SCENE, ScreenSize(3840, 2160)).eyes]
        assert len(places) == LENTICULAR.quilt.views
        assert places == sorted(places)
