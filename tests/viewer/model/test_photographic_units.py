"""Relative distance and f-number, against the pinhole camera and the thin lens written out."""

import math
from dataclasses import replace

import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.f_numbers import ASSUMED_DISTANCE_M, equivalent_f_number, f_number
from iibr_core.types import GridShape
from tests.viewer.model.test_opening import plan_of, scene_of
from viewer.model.inspection import Hover
from viewer.model.units import (
    disparity_at,
    distance_limits,
    f_number_text,
    metres,
    metres_text,
    relative_distance,
)
from viewer.ui.overlays.reticle import hover_text

FOCAL_PX, STEP_M = 1000.0, 0.01


def scene_at(still_m, scale=0.5):
    """A camera that steps by STEP_M from view to view of the given disparity; still_m: what does not move."""
    plan = plan_of(GridShape(9, 9), scale=scale, zero=FOCAL_PX * STEP_M / still_m)
    return scene_of(plan=plan, focal_px=FOCAL_PX, width=1000, height=700, disparity_range_px=(-1.0, 1.0))


@pytest.mark.parametrize("distance_m", [1.0, 2.0, 7.5])
def test_distance_follows_from_disparity_as_in_a_pinhole_camera(distance_m):
    scene = scene_at(still_m=4.0)
    given = FOCAL_PX * STEP_M / distance_m
    field = (given - FOCAL_PX * STEP_M / 4.0) * 0.5
    assert relative_distance(scene, field) == pytest.approx(distance_m / 4.0)
    assert disparity_at(scene, distance_m / 4.0) == pytest.approx(field)


def test_the_f_number_gives_the_blur_of_a_thin_lens():
    """Of a point at infinity while the still plane is sharp: aperture / focal distance, in focal lengths."""
    scene = scene_at(still_m=ASSUMED_DISTANCE_M)
    diameter = 3.0
    stop = f_number(scene, diameter)
    focal_m = FOCAL_PX / 1000 * 0.036
    aperture_m = focal_m / stop
    blur_px = aperture_m / ASSUMED_DISTANCE_M * FOCAL_PX
    field_at_infinity = (0 - FOCAL_PX * STEP_M / ASSUMED_DISTANCE_M) * 0.5
    assert blur_px == pytest.approx(diameter * abs(field_at_infinity))
    assert f_number(scene, 2 * diameter) == pytest.approx(stop / 2)
    assert f_number(scene, 0.0) is None
    assert relative_distance(scene, field_at_infinity) is None
    assert f_number_text(scene_of(disparity_range_px=(0.0, 0.0)), 3.0) == "pinhole", "a flat scene blurs nothing"


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
def test_nothing_is_said_where_nothing_is_known(scene):
    assert f_number(scene, 2.0) is None
    assert relative_distance(scene, 1.0) is None
    assert disparity_at(scene, 1.0) is None
    assert distance_limits(scene) is None


def test_the_equivalent_is_the_f_number_of_a_portrait_lens_that_blurs_alike():
    """With the nearest surface in focus at the assumed distance and the farthest at infinity; blur goes with the square
    of the focal length.
    """
    field_at_infinity = (0 - FOCAL_PX * STEP_M / ASSUMED_DISTANCE_M) * 0.5
    scene = replace(scene_at(still_m=ASSUMED_DISTANCE_M), disparity_range_px=(field_at_infinity, 0.0))
    stop = f_number(scene, 3.0)
    assert equivalent_f_number(scene, 3.0) == pytest.approx(stop * (85 / 36) ** 2)


def test_the_f_number_waits_for_the_depth_that_it_follows_from():
    for early in (scene_of(has_view_disparity=False), scene_of(is_sketch=True)):
        assert (f_number_text(early, 2.0), f_number_text(early, 0.0)) == ("f/…", "pinhole")


def test_metres_follow_from_the_disparity_that_metric_depth_became():
    scene = replace(scene_of(plan=plan_of(GridShape(9, 9), scale=0.5, zero=2.0)), inverse_metres=(0.1, 0.05))
    assert metres(scene, 1.0) == pytest.approx(1 / (0.1 * (1.0 / 0.5 + 2.0) + 0.05))
    assert metres(scene, -99.0) == math.inf
    assert metres(scene_of(), 1.0) is None
    assert [metres_text(m) for m in (0.421, 12.3, math.inf)] == ["0.42 m", "12 m", "∞"]


@pytest.mark.parametrize(
    ("disparity", "inverse_metres", "words"),
    [
        (0.0, None, "sharp"),
        (1.2, None, "20 % in front"),
        (-1.2, None, "20 % behind"),
        (0.0, (0.1, 0.5), "2.00 m  ·  sharp"),
        (2.5, (0.2, 0.5), "1.00 m  ·  1.00 m in front"),
        (-2.0, (0.25, 0.5), "∞  ·  far behind"),
    ],
)
def test_the_pointer_says_how_far_before_or_behind_the_focus_things_are(disparity, inverse_metres, words):
    scene = scene_of(plan=plan_of(GridShape(9, 9)), inverse_metres=inverse_metres)
    assert hover_text(Optics(), scene, Hover(30.0, 20.0, disparity)) == words
    in_pixels = f"{abs(disparity):.2f} px"
    assert in_pixels in hover_text(Optics(), scene, Hover(30.0, 20.0, disparity), "light field")
