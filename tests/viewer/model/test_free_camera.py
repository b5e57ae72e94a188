"""The camera that leaves the plane of the views: its limits, its poses, and what brings it back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond.optics import CENTRE
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import Camera, ImageSize
from tests.iibr_core.scenes import literal_plan, square_before_wall
from tests.viewer.model.test_reducers import scene_of, state_with
from viewer.app.keys import Keys, actions_from_keys
from viewer.model.actions import Action, AskToSave, OpenPath
from viewer.model.free_camera import (
    FORWARD_LIMITS,
    LEAST_SEEN,
    MOST_ASIDE,
    CameraProgress,
    FreeCamera,
    LeaveCamera,
    MoveCamera,
    Poses,
    StepPose,
    is_at_end,
    seen_share,
)
from viewer.model.lens.photographic_units import mean_depth
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.motion import ReturnHome
from viewer.model.state.optics_actions import MoveEye, ResetOptics, SetAperture, SetFocus
from viewer.model.state.prompts import SavePrompt


def poses_of(count: int, given: int) -> Poses:
    camera = Camera(np.eye(3), np.zeros(3), ImageSize(4, 6), (6.0, 6.0), (2.5, 1.5), "test")
    return Poses((camera,) * count, given)


def opened() -> AppState:
    """A photo's field is open."""
    return state_with(replace(scene_of(), plan=literal_plan(*square_before_wall(), 3)))


def test_it_moves_from_where_it_is() -> None:
    state = reduce(reduce(opened(), MoveCamera(forward=0.1)), MoveCamera(0.2, -0.1, 0.1))
    assert state.free_camera == FreeCamera(None, 0.2, -0.1, 0.2)


def test_before_a_photo_is_open_there_is_nothing_to_look_around_in() -> None:
    for action in (MoveCamera(0.1), StepPose(1)):
        assert reduce(AppState(), action).free_camera is None


@pytest.mark.parametrize("value", [1e300, math.inf, math.nan, -math.inf, -5.0])
def test_it_stays_within_its_limits(value: float) -> None:
    camera = reduce(opened(), MoveCamera(value, value, value)).free_camera
    assert camera is not None
    assert max(abs(camera.right), abs(camera.down)) <= MOST_ASIDE
    assert FORWARD_LIMITS[0] <= camera.forward <= FORWARD_LIMITS[1]


def test_it_stops_where_the_photo_ends() -> None:
    """However it comes there: less than LEAST_SEEN of its picture would be the photo's."""
    for step in (MoveCamera(right=0.05, down=0.05), MoveCamera(right=-0.05, forward=-0.05), MoveCamera(down=0.2)):
        state = opened()
        assert state.scene is not None
        depth = mean_depth(state.scene)
        for _ in range(40):
            state = reduce(state, step)
            assert state.free_camera is not None
            assert seen_share(state.free_camera, depth) >= LEAST_SEEN - 1e-6
        assert is_at_end(state.free_camera, depth)
        back = reduce(state, MoveCamera(-step.right, -step.down, -step.forward)).free_camera
        assert back is not None
        assert not is_at_end(back, depth)


def test_nearer_it_may_look_farther_aside() -> None:
    """As its picture is a smaller part of the photo's."""
    asides = []
    for forward in (-0.2, 0.0, 0.5):
        camera = reduce(reduce(opened(), MoveCamera(forward=forward)), MoveCamera(0.6, 0.6)).free_camera
        assert camera is not None
        asides.append(camera.right)
    assert asides == sorted(asides)
    assert asides[0] < asides[1] < asides[2]


def test_how_much_of_its_picture_is_the_photos() -> None:
    assert seen_share(FreeCamera(), 2.0) == 1.0
    assert seen_share(FreeCamera(right=0.5), 2.0) == pytest.approx(0.75)
    assert seen_share(FreeCamera(right=0.5, down=-0.5), 2.0) == pytest.approx(0.75**2)
    assert seen_share(FreeCamera(forward=-0.4), 2.0) == pytest.approx(1 / 1.2**2)
    assert seen_share(FreeCamera(right=0.2, forward=0.5), 2.0) == 1.0


def test_poses_follow_the_photos_own_in_a_circle() -> None:
    state = replace(opened(), poses=poses_of(3, 1))
    numbers = []
    for _ in range(3):
        state = reduce(state, StepPose(1))
        assert state.free_camera is not None
        numbers.append(state.free_camera.pose)
    assert numbers == [2, 0, 1]
    assert reduce(state, StepPose(-1)).free_camera == FreeCamera(0)


def test_without_poses_that_is_told() -> None:
    state = reduce(opened(), StepPose(1))
    assert state.free_camera is None
    assert "no poses" in state.notices[-1].text


def test_a_light_field_from_disk_cannot_be_looked_around_in() -> None:
    state = opened()
    assert state.scene is not None
    told = reduce(replace(state, scene=replace(state.scene, plan=None)), MoveCamera(forward=0.1))
    assert told.free_camera is None
    assert "open a photo" in told.notices[-1].text


@pytest.mark.parametrize("action", [LeaveCamera(), ResetOptics(), ReturnHome(), OpenPath(Source("b.png"))])
def test_what_goes_back_to_the_views(action: Action) -> None:
    state = reduce(opened(), MoveCamera(forward=0.1))
    assert state.free_camera is not None
    assert reduce(state, action).free_camera is None


@pytest.mark.parametrize("action", [MoveEye(CENTRE), SetAperture(2.0), SetFocus(0.5)])
def test_it_looks_through_the_same_lens(action: Action) -> None:
    state = reduce(reduce(opened(), MoveCamera(forward=0.1)), action)
    assert state.free_camera == FreeCamera(forward=0.1)
    assert state.optics == reduce(opened(), action).optics


def test_esc_goes_back_to_the_views() -> None:
    state = reduce(opened(), MoveCamera(forward=0.1))
    assert actions_from_keys(Keys(is_escape=True), state) == [LeaveCamera()]


def test_how_far_it_is_lasts_until_it_is_there() -> None:
    state = reduce(opened(), CameraProgress(0.25))
    assert state.free_progress == 0.25
    assert reduce(state, CameraProgress(None)).free_progress is None


def test_its_picture_is_saved_at_the_size_of_the_views() -> None:
    state = opened()
    assert state.scene is not None
    state = replace(state, scene=replace(state.scene, own_size=ScreenSize(4000, 3000)))
    for camera, size in ((None, ScreenSize(4000, 3000)), (FreeCamera(forward=0.1), state.scene.size)):
        prompt = reduce(replace(state, free_camera=camera), AskToSave("picture")).prompt
        assert isinstance(prompt, SavePrompt)
        assert prompt.size_px == size


def test_another_photo_has_no_poses() -> None:
    assert reduce(replace(opened(), poses=poses_of(2, 0)), OpenPath(Source("b.png"))).poses is None
