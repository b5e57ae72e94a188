"""Relative distance and f-number, against the pinhole camera and the thin lens written out."""

from __future__ import annotations

import pytest

from iibr_core.types import GridShape
from tests.viewer.model.test_reducers import plan_of, scene_of
from viewer.model.lens.photographic_units import (
    ASSUMED_DISTANCE_M,
    disparity_at,
    distance_limits,
    f_number,
    relative_distance,
)
from viewer.model.state.app_state import Scene

FOCAL_PX, STEP_M = 1000.0, 0.01


def scene_at(still_m: float, scale: float = 0.5) -> Scene:
    """A camera that steps by STEP_M from view to view of the given disparity; still_m: what does not move."""
    plan = plan_of(GridShape(9, 9), scale=scale, zero=FOCAL_PX * STEP_M / still_m)
    return scene_of(plan=plan, focal_px=FOCAL_PX, width=1000, height=700, disparity_range_px=(-1.0, 1.0))


@pytest.mark.parametrize("distance_m", [1.0, 2.0, 7.5])
def test_distance_follows_from_disparity_as_in_a_pinhole_camera(distance_m: float) -> None:
    scene = scene_at(still_m=4.0)
    given = FOCAL_PX * STEP_M / distance_m
    field = (given - FOCAL_PX * STEP_M / 4.0) * 0.5
    assert relative_distance(scene, field) == pytest.approx(distance_m / 4.0)
    assert disparity_at(scene, distance_m / 4.0) == pytest.approx(field)


def test_the_f_number_gives_the_blur_of_a_thin_lens() -> None:
    """Of a point at infinity while the still plane is sharp: aperture / focal distance, in focal lengths."""
    scene = scene_at(still_m=ASSUMED_DISTANCE_M)
    diameter = 3.0
    stop = f_number(scene, diameter)
    assert stop is not None
    focal_m = FOCAL_PX / 1000 * 0.036
    aperture_m = focal_m / stop
    blur_px = aperture_m / ASSUMED_DISTANCE_M * FOCAL_PX
    field_at_infinity = (0 - FOCAL_PX * STEP_M / ASSUMED_DISTANCE_M) * 0.5
    assert blur_px == pytest.approx(diameter * abs(field_at_infinity))
    assert f_number(scene, 2 * diameter) == pytest.approx(stop / 2)


@pytest.mark.parametrize(
    "scene",
    [
        scene_of(),
        scene_of(focal_px=FOCAL_PX),
        scene_of(plan=plan_of(GridShape(9, 9), zero=5.0)),
        scene_of(plan=plan_of(GridShape(9, 9), zero=-5.0), focal_px=FOCAL_PX),
        scene_of(plan=plan_of(GridShape(1, 1), scale=0.0), focal_px=FOCAL_PX),
    ],
)
def test_nothing_is_said_where_nothing_is_known(scene: Scene) -> None:
    assert f_number(scene, 2.0) is None
    assert relative_distance(scene, 1.0) is None
    assert disparity_at(scene, 1.0) is None
    assert distance_limits(scene) is None


def test_a_pinhole_has_no_f_number_and_infinity_no_distance() -> None:
    scene = scene_at(still_m=4.0)
    assert f_number(scene, 0.0) is None
    assert relative_distance(scene, -FOCAL_PX * STEP_M / 4.0 * 0.5) is None
    assert disparity_at(scene, 0.0) is None
