"""The camera that leaves the plane of the views: its limits, its poses, and what brings it back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.types import Camera, ImageSize
from tests.iibr_core.scenes import literal_plan, square_before_wall
from tests.viewer.model.test_reducers import scene_of, state_with
from viewer.model.actions import OpenPath, ReturnHome
from viewer.model.free_camera import FORWARD_LIMITS, MOST_ASIDE, FreeCamera, MoveCamera, Poses, StepPose
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.optics import CENTRE, MoveEye, ResetOptics
from viewer.model.state.scene import Source


def poses_of(count: int, given: int) -> Poses:
    camera = Camera(np.eye(3), np.zeros(3), ImageSize(4, 6), (6.0, 6.0), (2.5, 1.5), "test")
    return Poses((camera,) * count, given)


def opened() -> AppState:
    """A photo's field is open."""
    return state_with(replace(scene_of(), plan=literal_plan(*square_before_wall(), 3)))


def test_it_moves_from_where_it_is() -> None:
    state = reduce(reduce(opened(), MoveCamera(forward=0.1)), MoveCamera(0.2, -0.1, 0.1))
    assert state.free_camera == FreeCamera(None, 0.2, -0.1, 0.2)


@pytest.mark.parametrize("value", [1e300, math.inf, math.nan, -math.inf, -5.0])
def test_it_stays_within_its_limits(value: float) -> None:
    camera = reduce(opened(), MoveCamera(value, value, value)).free_camera
    assert camera is not None
    assert max(abs(camera.right), abs(camera.down)) <= MOST_ASIDE
    assert FORWARD_LIMITS[0] <= camera.forward <= FORWARD_LIMITS[1]


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


@pytest.mark.parametrize("action", [MoveEye(CENTRE), ResetOptics(), ReturnHome(), OpenPath(Source("b.png"))])
def test_what_moves_the_lens_goes_back_to_the_views(action: object) -> None:
    state = reduce(opened(), MoveCamera(forward=0.1))
    assert state.free_camera is not None
    assert reduce(state, action).free_camera is None  # type: ignore[arg-type]


def test_another_photo_has_no_poses() -> None:
    assert reduce(replace(opened(), poses=poses_of(2, 0)), OpenPath(Source("b.png"))).poses is None
