"""The zoomed picture: where it lies, what of it is seen, and that the window's one map between the two holds there."""

from dataclasses import replace

import pytest

from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape
from viewer.model import opening, viewpoint
from viewer.model.app_state import AppState
from viewer.model.layout import MAX_ZOOM, Beside, Zoom, layout_of, pixel_at

WINDOW, SIZE, OWN_WIDTH = ScreenSize(1280, 800), ScreenSize(600, 400), 4800
SCENE = Scene(Source("photo.png"), "photo", 600, 400, GridShape(9, 9), (-2.0, 3.0), "photo.pfm")
STATE = AppState(source=SCENE.source, scene=SCENE)
PLACES = (Zoom(1.0), Zoom(0.5, (0.0, 1.0)), Zoom(2.3, (0.31, 0.77)), Zoom(0.05), Zoom(0.3, (1.0, 0.0)))


def laid_out(zoom, ratio=1.0):
    return layout_of(WINDOW, SIZE, ratio, zoom=zoom, own_width=OWN_WIDTH)


@pytest.mark.parametrize("ratio", [1.0, 2.0])
@pytest.mark.parametrize("zoom", PLACES)
def test_the_pixels_of_the_frame_show_the_part_that_lies_there(zoom, ratio):
    layout = laid_out(zoom, ratio)
    picture, frame_px, part = layout.picture, layout.frame_px, layout.part
    assert picture.width * ratio == pytest.approx(zoom.scale * OWN_WIDTH)
    assert frame_px.width == pytest.approx(part.width * picture.width * ratio)
    for x_share, y_share in ((0.0, 0.0), (0.3, 0.9)):
        x, y = (frame_px.x + x_share * frame_px.width) / ratio, (frame_px.y + y_share * frame_px.height) / ratio
        at = pixel_at(picture, SIZE, x, y)
        assert (at[0] + 0.5) / SIZE.width == pytest.approx(part.x + x_share * part.width)
        assert (at[1] + 0.5) / SIZE.height == pytest.approx(part.y + y_share * part.height)


@pytest.mark.parametrize("zoom", PLACES)
def test_the_frame_stays_within_the_room_and_in_the_picture(zoom):
    layout = layout_of(WINDOW, SIZE, beside=Beside((9, 9), has_status=True), zoom=zoom, own_width=OWN_WIDTH)
    frame, room, across = layout.frame, layout.room, layout.strip_across
    assert frame.within(room) == frame
    assert across.y + across.height <= WINDOW.height
    part, small = layout.part, layout.minimap
    if small is not None:
        corner = frame.x + frame.width - small.x - small.width, frame.y + frame.height - small.y - small.height
        assert corner[0] == pytest.approx(corner[1])
        assert 0 < corner[0] < 20, "in the lower right corner"
    edge = 1 / frame.width
    assert -edge <= part.x <= part.x + part.width <= 1 + edge
    assert -edge <= part.y <= part.y + part.height <= 1 + edge


@pytest.mark.parametrize("notches", [1.0, 3.0, -1.0, 0.2])
def test_what_lies_under_the_pointer_stays_there(notches):
    before = laid_out(Zoom(0.6, (0.4, 0.6)))
    x, y = 420.0, 300.0
    after = laid_out(before.zoomed(notches, x, y))
    on_screen = after.picture.width / SIZE.width
    there, here = pixel_at(before.picture, SIZE, x, y), pixel_at(after.picture, SIZE, x, y)
    assert here == pytest.approx(there, abs=1 / on_screen)  # the picture lies on whole pixels of the screen


def test_the_wheel_ends_at_the_whole_picture_and_at_the_largest():
    layout = laid_out(None)
    assert layout.zoomed(-3.0, 400, 300) is None
    nearest = layout.zoomed(100.0, 400, 300)
    assert nearest.scale == MAX_ZOOM
    assert laid_out(nearest).zoomed(-100.0, 400, 300) is None


def test_a_photo_smaller_than_the_window_is_seen_at_its_own_pixels_in_the_middle():
    layout = layout_of(WINDOW, ScreenSize(60, 40), zoom=Zoom(1.0))
    assert layout.frame_px.size == (60, 40)
    assert layout.minimap is None
    assert layout.zoomed(-2.0, 400, 300) == Zoom(1.0, pytest.approx((0.5, 0.5), abs=0.02))
    assert layout.zoomed(100.0, 400, 300) is None  # the wheel stops where it fits
    nearest = layout_of(WINDOW, ScreenSize(60, 40)).zoomed(100.0, 400, 300)
    assert nearest.scale == MAX_ZOOM * layout.fit


def test_the_picture_follows_the_hand_as_far_as_it_goes():
    before = laid_out(Zoom(1.0))
    after = laid_out(before.pulled(30.0, -20.0))
    assert after.picture.x - before.picture.x == pytest.approx(30)
    assert after.picture.y - before.picture.y == pytest.approx(-20)
    far = laid_out(before.pulled(1e6, 1e6))
    assert far.part.x == pytest.approx(0, abs=1e-3)
    assert laid_out(far.pulled(-5.0, 0.0)).part.x > far.part.x  # nothing is stored up beyond the border
    assert laid_out(None).pulled(30.0, 30.0) is None


def test_another_photo_is_seen_whole_and_the_same_one_as_before():
    zoomed = viewpoint.set_zoom(STATE, Zoom(1.0))
    assert opening.show_scene(zoomed, zoomed.generation, replace(SCENE)).zoom == Zoom(1.0)
    asked = opening.open_source(zoomed, Source("other.png"))
    other = replace(SCENE, source=asked.source)
    assert opening.show_scene(asked, asked.generation, other).zoom is None
    assert viewpoint.set_zoom(AppState(), Zoom(1.0)).zoom is None
