"""Picking against a slow twin that lets every pixel of the view land."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.types import CENTRE, ViewOffset
from viewer.display.picking import LANDING_RADIUS_PX, pick_disparity


@given(seed=st.integers(0, 99), t=st.floats(-3, 3), s=st.floats(-3, 3), x=st.floats(-40, 55), y=st.floats(-40, 51))
def test_picks_what_the_slow_twin_picks(seed, t, s, x, y):
    disparity = np.random.default_rng(seed).uniform(-2, 2, (12, 16)).astype(np.float32)
    picked = pick_disparity({CENTRE: disparity}, ViewOffset(t, s), x, y)
    rows, columns = np.indices(disparity.shape)
    distance = np.hypot(columns - disparity * s - x, rows - disparity * t - y)
    if distance.min() <= LANDING_RADIUS_PX:
        assert picked == disparity[distance <= LANDING_RADIUS_PX].max()
    elif distance.min() <= 1:
        assert picked == disparity.flat[distance.argmin()]
    else:  # far outside, the twin looks at pixels that cannot be under the pointer
        assert picked in disparity


def test_the_map_nearest_to_the_eye_is_asked():
    maps = {CENTRE: np.zeros((4, 4), np.float32), ViewOffset(0, 4): np.full((4, 4), 0.25, np.float32)}
    assert pick_disparity(maps, ViewOffset(0, 1.9), 2, 2) == 0.0
    assert pick_disparity(maps, ViewOffset(0, 2.1), 2, 2) == 0.25
