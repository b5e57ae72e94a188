"""The camera that leaves the plane of the views: its limits, and what brings it back."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from iibr_core.beyond.optics import CENTRE
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from tests.iibr_core.scenes import literal_plan, square_before_wall
from tests.viewer.conftest import reduce
from tests.viewer.model.test_reducers import scene_of, state_with
from viewer.app.keys import Keys, actions_from_keys
from viewer.model import lens, opening, saving, viewpoint
from viewer.model.action import Action, do
from viewer.model.state.app_state import AppState
from viewer.model.state.prompts import SavePrompt
from viewer.model.state.viewpoint import FORWARD_LIMITS, MAX_ASIDE, FreeCamera


def opened() -> AppState:
    """A photo's field is open."""
    return state_with(replace(scene_of(), plan=literal_plan(*square_before_wall(), 3)))


def test_it_moves_from_where_it_is() -> None:
    state = reduce(reduce(opened(), do(viewpoint.move_camera, forward=0.1)), do(viewpoint.move_camera, 0.2, -0.1, 0.1))
    assert state.free_camera == FreeCamera(0.2, -0.1, 0.2)


def test_before_a_photo_is_open_there_is_nothing_to_look_around_in() -> None:
    assert reduce(AppState(), do(viewpoint.move_camera, 0.1)).free_camera is None


@pytest.mark.parametrize(
    ("step", "end"),
    [
        ((0.0, 0.0, 0.05), FreeCamera(forward=FORWARD_LIMITS[1])),
        ((0.0, 0.0, -0.05), FreeCamera(forward=FORWARD_LIMITS[0])),
        ((-0.05, 0.05, 0.0), FreeCamera(right=-MAX_ASIDE, down=MAX_ASIDE)),
        ((1e300, -1e300, 1e300), FreeCamera(MAX_ASIDE, -MAX_ASIDE, FORWARD_LIMITS[1])),
    ],
)
def test_steps_lead_to_the_limits_and_back(step: tuple[float, float, float], end: FreeCamera) -> None:
    state = opened()
    for _ in range(40):
        state = viewpoint.move_camera(state, *step)
    assert state.free_camera == end
    assert end.is_at_end
    back = viewpoint.move_camera(state, *(-part / 2 for part in step)).free_camera
    assert back is not None
    assert back != end


@pytest.mark.parametrize("value", [math.inf, math.nan])
def test_numbers_that_are_not_finite_move_nothing(value: float) -> None:
    assert reduce(opened(), do(viewpoint.move_camera, value, 0.1, 0.1)).free_camera is None


def test_a_light_field_from_disk_cannot_be_looked_around_in() -> None:
    state = opened()
    assert state.scene is not None
    told = reduce(replace(state, scene=replace(state.scene, plan=None)), do(viewpoint.move_camera, forward=0.1))
    assert told.free_camera is None
    assert "needs a photo" in told.notices[-1].text


@pytest.mark.parametrize(
    "action",
    [do(viewpoint.leave_camera), do(lens.reset), do(viewpoint.return_home), do(opening.open_source, Source("b.png"))],
)
def test_what_goes_back_to_the_views(action: Action) -> None:
    state = reduce(opened(), do(viewpoint.move_camera, forward=0.1))
    assert state.free_camera is not None
    assert reduce(state, action).free_camera is None


@pytest.mark.parametrize("action", [do(lens.move_eye, CENTRE), do(lens.set_aperture, 2.0), do(lens.set_focus, 0.5)])
def test_it_looks_through_the_same_lens(action: Action) -> None:
    state = reduce(reduce(opened(), do(viewpoint.move_camera, forward=0.1)), action)
    assert state.free_camera == FreeCamera(forward=0.1)
    assert state.optics == reduce(opened(), action).optics


def test_esc_goes_back_to_the_views() -> None:
    state = reduce(opened(), do(viewpoint.move_camera, forward=0.1))
    assert actions_from_keys(Keys(is_escape=True), state) == [do(viewpoint.leave_camera)]


def test_how_far_it_is_lasts_until_it_is_there() -> None:
    state = reduce(opened(), do(viewpoint.report_camera, 0.25))
    assert state.free_progress == 0.25
    assert reduce(state, do(viewpoint.report_camera, None)).free_progress is None


def test_its_picture_is_saved_at_the_size_of_the_views() -> None:
    state = opened()
    assert state.scene is not None
    state = replace(state, scene=replace(state.scene, own_size=ScreenSize(4000, 3000)))
    for camera, size in ((None, ScreenSize(4000, 3000)), (FreeCamera(forward=0.1), state.scene.size)):
        prompt = reduce(replace(state, free_camera=camera), do(saving.ask_to_save, "picture")).prompt
        assert isinstance(prompt, SavePrompt)
        assert prompt.size_px == size
