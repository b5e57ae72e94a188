"""The tilted plane of focus: through both handles, level across them, and clicked things sharp on it."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.rect import Rect
from iibr_core.types import GridShape
from tests.viewer.model.test_opening import scene_of
from viewer.model.focal_plane import (
    MIN_HANDLE_DISTANCE,
    handle_points,
    place_of,
    sharp_disparity,
    tilt_through,
)
from viewer.model.lens import TiltHandles

shares = st.floats(-1, 1)
places = st.tuples(shares, shares)
disparities = st.floats(-5, 5)


@given(places, places, disparities, disparities, st.tuples(disparities, disparities), st.floats(0.1, 3))
def test_the_plane_runs_through_both_handles_and_is_level_across_them(moved, kept, there, focus, tilt, aspect):
    line = moved[0] - kept[0], (moved[1] - kept[1]) * aspect
    assume(math.hypot(*line) >= MIN_HANDLE_DISTANCE)
    before = Optics(focus_disparity=focus, focus_tilt=tilt)
    after = tilt_through(before, moved, there, kept, aspect)
    assert sharp_disparity(after, moved) == pytest.approx(there, abs=1e-6)
    assert sharp_disparity(after, kept) == pytest.approx(sharp_disparity(before, kept), abs=1e-6)
    across = kept[0] - line[1], kept[1] + line[0] / aspect  # a right angle to the line, as the eye sees it
    assert sharp_disparity(after, across) == pytest.approx(sharp_disparity(after, kept), abs=1e-6)


def test_handles_on_one_spot_move_the_plane_without_tipping_it():
    before = Optics(focus_tilt=(0.5, -0.5))
    after = tilt_through(before, (0.2, 0.2), 2.0, (0.2, 0.21), 1.0)
    assert after.focus_tilt == before.focus_tilt
    assert sharp_disparity(after, (0.2, 0.2)) == pytest.approx(2.0)


def test_places_of_pixels_and_handles():
    scene = scene_of(GridShape(3, 3), width=100, height=50)
    assert place_of(-0.5, -0.5, scene) == (-1, -1)
    assert place_of(99.5, 49.5, scene) == (1, 1)
    assert place_of(49.5, 24.5, scene) == (0, 0)
    handles = TiltHandles((-1, -1), (0, 0.5))
    assert handle_points(handles, Rect(10, 20, 200, 100)) == ((10, 20), (110, 95))
