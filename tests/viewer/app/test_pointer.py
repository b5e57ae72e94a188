"""The mouse as pure functions: what they ask for, and which way things move."""

from dataclasses import replace

import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape, ViewOffset
from viewer.app.pointer import DRAG_ACROSS_GRID, Pointer, actions_from_hover, actions_from_pointer
from viewer.model import inspection, lens, viewpoint
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.focal_plane import handle_points
from viewer.model.inspection import Hover
from viewer.model.layout import Zoom, layout_of
from viewer.model.lens import TiltHandles

SCENE = Scene(Source("photo.png", max_pixels=7), "photo", 600, 400, GridShape(9, 9), (-2.0, 3.0), "photo.pfm")
STATE = AppState(source=SCENE.source, scene=SCENE)
LAYOUT = layout_of((1280, 800), (600, 400))
PICTURE = LAYOUT.picture
assert PICTURE is not None
MIDDLE = PICTURE.x + PICTURE.width / 2, PICTURE.y + PICTURE.height / 2
OVER_PICTURE = Pointer(x=MIDDLE[0], y=MIDDLE[1], pressed_x=MIDDLE[0], pressed_y=MIDDLE[1])


def asked(pointer, state=STATE, layout=LAYOUT, picked=1.5):
    return list(actions_from_pointer(pointer, layout, state, lambda x, y: picked))


@pytest.mark.parametrize(("step_x", "step_y"), [(10, 0), (-7, 0), (0, 5), (3, -4)])
def test_near_things_follow_the_hand(step_x, step_y):
    """A point of disparity d is seen at x - d * s: for d > 0 it must move the way the pointer moved."""
    state = replace(STATE, optics=Optics(eye=ViewOffset(1.0, 2.0)))
    (move,) = asked(replace(OVER_PICTURE, is_down=True, drag_distance=30, step_x=step_x, step_y=step_y), state)
    assert move.verb is lens.move_eye
    d, eye = SCENE.disparity_range_px[1], move.args[0]
    for moved, hand in ((-d * (eye.s - 2.0), step_x), (-d * (eye.t - 1.0), step_y)):
        assert moved * hand >= 0
        assert abs(moved) <= abs(hand)
        assert (moved == 0) == (hand == 0)


@pytest.mark.parametrize("nearest", [0.5, 200.0])
def test_the_nearest_surface_sticks_to_the_pointer_unless_the_grid_is_crossed_too_fast(nearest):
    scene = replace(SCENE, disparity_range_px=(0.0, nearest))
    (move,) = asked(replace(OVER_PICTURE, is_down=True, drag_distance=30, step_x=10), replace(STATE, scene=scene))
    sticks = 10 * scene.width / PICTURE.width / nearest
    crosses = 10 * (scene.grid.columns - 1) / (DRAG_ACROSS_GRID * PICTURE.width)
    assert -move.args[0].s == pytest.approx(min(sticks, crosses))
    assert asked(replace(OVER_PICTURE, is_released=True, clicks=1), AppState()) == []


def test_what_moved_before_it_was_a_drag_and_in_the_frame_of_the_release_counts():
    moved = replace(OVER_PICTURE, x=OVER_PICTURE.x + 12, drag_distance=12, step_x=7)
    (late,) = asked(replace(moved, is_down=True, becomes_drag=True))
    (whole,) = asked(replace(moved, is_down=True, step_x=12))
    assert late == whole
    (released,) = asked(replace(moved, is_released=True, becomes_drag=True))
    assert released == whole, "all of it in one frame is no click"
    (last,) = asked(replace(moved, is_released=True))
    (step,) = asked(replace(moved, is_down=True))
    assert last == step


@pytest.mark.parametrize(
    ("pointer", "expected"),
    [
        (replace(OVER_PICTURE), []),
        (replace(OVER_PICTURE, is_down=True, drag_distance=2, step_x=2), []),
        (replace(OVER_PICTURE, is_released=True, clicks=1, drag_distance=40), []),
        (replace(OVER_PICTURE, is_released=True, clicks=2), [do(viewpoint.return_home, takes_back_click=True)]),
        (replace(OVER_PICTURE, is_released=True, clicks=1, is_over_panel=True), []),
        (replace(OVER_PICTURE, is_down=True, drag_distance=40, step_x=9, is_over_panel=True), []),
        (replace(OVER_PICTURE, wheel=1.0, is_over_panel=True), []),
        (replace(OVER_PICTURE, wheel=1.0, x=1.0, y=1.0), []),
        (replace(OVER_PICTURE, is_released=True, clicks=1, pressed_x=1.0, pressed_y=1.0), []),
    ],
)
def test_what_does_nothing_or_resets(pointer, expected):
    assert asked(pointer) == expected


WITH_HANDLES = replace(STATE, tilt_handles=TiltHandles())
HANDLES = handle_points(TiltHandles(), PICTURE)


@pytest.mark.parametrize("index", [0, 1])
def test_a_drag_that_begins_on_a_handle_moves_it_onto_what_is_there(index):
    x, y = HANDLES[index]
    pointer = replace(OVER_PICTURE, pressed_x=x + 5, pressed_y=y - 5, is_down=True, drag_distance=30, step_x=3)
    assert asked(pointer, WITH_HANDLES) == [do(lens.move_tilt_handle, index, pytest.approx((0, 0)), 1.5)]
    assert asked(pointer, WITH_HANDLES, picked=None) == [do(lens.move_tilt_handle, index, pytest.approx((0, 0)), None)]
    (move,) = asked(pointer)
    assert move.verb is lens.move_eye, "no handles shown"
    pointer = replace(OVER_PICTURE, is_down=True, drag_distance=300, step_x=3)
    (move,) = asked(pointer, WITH_HANDLES)
    assert move.verb is lens.move_eye, "beside the handles"
    (move,) = asked(pointer, replace(STATE, tilt_handles=TiltHandles(taken=index)))
    assert (move.verb, move.args[0]) == (lens.move_tilt_handle, index), "a handle that was taken is kept"


def hovered(pointer, state=STATE):
    return list(actions_from_hover(pointer, LAYOUT, state, lambda x, y: x / 100))


def test_the_pointer_says_once_where_it_is_and_once_that_it_left():
    (found,) = hovered(OVER_PICTURE)
    assert found == do(inspection.set_hover, Hover(pytest.approx(299.5), pytest.approx(199.5), pytest.approx(2.995)))
    there = found.apply(STATE)
    assert hovered(OVER_PICTURE, there) == []
    outside = (
        replace(OVER_PICTURE, x=1.0),
        replace(OVER_PICTURE, is_over_panel=True),
        replace(OVER_PICTURE, is_down=True, drag_distance=50),
    )
    for pointer in outside:
        assert hovered(pointer, there) == [do(inspection.set_hover, None)]
        assert hovered(pointer) == []


ZOOMED = layout_of((1280, 800), (600, 400), zoom=Zoom(4.0), own_width=600)


def test_a_press_on_the_small_picture_moves_the_large_one_and_points_at_nothing():
    at = ZOOMED.minimap
    x, y = at.x + 0.8 * at.width, at.y + 0.3 * at.height
    pointer = Pointer(x=x, y=y, pressed_x=x, pressed_y=y)
    for held in (replace(pointer, is_down=True), replace(pointer, is_released=True, clicks=2)):
        (action,) = asked(held, layout=ZOOMED)
        assert action.verb is viewpoint.set_zoom
        assert action.args[0].centre == pytest.approx((0.8, 0.3))
    assert actions_from_hover(pointer, ZOOMED, STATE, lambda x, y: 1.5) == []


def test_the_divider_follows_the_hand_across_the_seen_part_of_a_zoomed_picture():
    frame, compared = ZOOMED.frame, inspection.compare(STATE, "photo")
    x, y = frame.x + 0.5 * frame.width, frame.y + 0.5 * frame.height
    pointer = Pointer(frame.x + 0.3 * frame.width, y, drag_distance=30, pressed_x=x, pressed_y=y, is_down=True)
    assert asked(pointer, compared, ZOOMED) == [do(inspection.move_divider, pytest.approx(0.3))]
