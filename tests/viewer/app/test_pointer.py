"""The mouse as pure functions: what they ask for, and which way things move."""

from dataclasses import replace

import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape, ViewOffset
from viewer.app.pointer import DRAG_ACROSS_GRID, Pointer, actions_from_pointer
from viewer.model import lens
from viewer.model.app_state import AppState
from viewer.model.layout import layout_of

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
