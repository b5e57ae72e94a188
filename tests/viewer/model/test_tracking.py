"""A head that moves the viewpoint: packets, directions, ends, the filter, and what a hand does meanwhile."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.scenes.lens_limits import clamp_eye
from iibr_core.types import GridShape, InputError, ViewOffset
from tests.viewer.model.test_opening import grids, scene_of, state_with
from viewer.model import tracking
from viewer.model.tracking import HEAD_RANGE_LIMITS, address_of, eye_of, head_in, offset_of, smooth

FIVE = scene_of(GridShape(5, 5))


def followed(state, *heads):
    for head in heads:
        state = tracking.follow(state, head, 5.0)
    return state


def tracked(*heads):
    """Return the state after places of the head, the first of which is the centre."""
    return followed(tracking.switch(state_with(FIVE), "udp"), *heads)


def pose(x=0.0, y=0.0, yaw=0.0, pitch=0.0):
    return struct.pack("<6d", x, y, 60.0, yaw, pitch, 3.0)


@pytest.mark.parametrize(
    ("packet", "eye"),
    [
        (pose(x=-15), ViewOffset(0, 2)),  # opentrack's x grows to the left of the person
        (pose(x=15), ViewOffset(0, -2)),
        (pose(y=15), ViewOffset(-2, 0)),
        (pose(y=-15), ViewOffset(2, 0)),
        (pose(yaw=30), ViewOffset(0, 2)),
        (pose(pitch=30), ViewOffset(-2, 0)),
        (pose(x=-15, yaw=-90, pitch=90), ViewOffset(0, 2)),
        (pose(x=-1000, y=-1000), ViewOffset(2, 2)),
    ],
)
def test_the_viewpoint_goes_where_the_head_goes(packet, eye):
    head = head_in(packet)
    assert tracked(0j, head).optics.eye == pytest.approx(eye)


@pytest.mark.parametrize(
    "packet",
    [
        b"",
        pose()[:-1],
        pose() + b"\0",
        b"\xff" * 48,
        *(pose(x=number) for number in (math.nan, math.inf, -math.inf, 1e300)),
    ],
)
def test_packets_that_are_no_poses_are_dropped(packet):
    assert head_in(packet) is None


def test_the_viewpoint_slows_down_towards_the_outermost_views_and_stays_there():
    eyes = [tracked(0j, complex(cm)).optics.eye.s for cm in range(0, 40)]
    steps = np.diff(eyes)
    assert np.all(np.diff(steps) <= 1e-12)
    assert eyes[15:] == [2.0] * len(eyes[15:])
    assert [tracked(0j, complex(-cm)).optics.eye.s for cm in range(0, 40)] == [-eye for eye in eyes]


@given(grids, st.floats(*HEAD_RANGE_LIMITS), st.floats(0.25, 4), st.complex_numbers(max_magnitude=1000))
def test_any_viewpoint_has_its_place_of_the_head(grid, range_cm, row_step, cm):
    scene = scene_of(grid, row_step=row_step)
    eye = eye_of(cm, range_cm, scene)
    assert eye == clamp_eye(eye, grid)
    assert eye_of(offset_of(eye, range_cm, scene), range_cm, scene) == pytest.approx(eye, abs=1e-6)


def test_a_centimetre_is_as_long_across_as_down():
    scene = scene_of(GridShape(3, 9), row_step=0.5)
    eye = eye_of(0.1 + 0.1j, 15, scene)
    assert scene.in_columns(eye).t == pytest.approx(eye.s, rel=1e-2)
    assert eye_of(60 + 60j, 15, scene) == ViewOffset(1, 4)


# Filter


@pytest.mark.parametrize(("rate_hz", "factor"), [(30, 2.5), (60, 3.5), (250, 6)])
def test_noise_of_a_millimetre_is_reduced(rate_hz, factor):
    rng = np.random.default_rng(0)
    noise = rng.normal(0, 0.1, (rate_hz * 20, 2)) @ (1, 1j)
    smoothed, places = None, []
    for i, place in enumerate(noise):
        smoothed = smooth(smoothed, complex(place), i / rate_hz)
        places.append(smoothed.place)
    assert np.std(places[rate_hz:]) < np.std(noise) / factor


@pytest.mark.parametrize("rate_hz", [30, 60, 250])
@pytest.mark.parametrize("speed_cm", [5, 20, 100])
def test_a_moving_head_lags_little(rate_hz, speed_cm):
    smoothed = None
    for i in range(rate_hz):
        smoothed = smooth(smoothed, complex(speed_cm * i / rate_hz, 0), i / rate_hz)
    lag_cm = speed_cm * (rate_hz - 1) / rate_hz - smoothed.place.real
    assert 0 <= lag_cm < 0.35


def test_the_filter_starts_again_after_a_pause_and_takes_packets_of_one_moment():
    first = smooth(None, 1j, 10.0)
    assert smooth(first, 5j, 10.0) == first
    assert smooth(first, 5j, 9.0) == first
    assert smooth(first, 5j, 11.0).place == 5j
    assert 1 < smooth(first, 5j, 10.1).place.imag < 5


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("udp", ("127.0.0.1", 4242)),
        ("udp:5000", ("127.0.0.1", 5000)),
        ("udp:0.0.0.0", ("0.0.0.0", 4242)),
        ("udp:localhost:65535", ("localhost", 65535)),
    ],
)
def test_addresses(text, place):
    assert address_of(text) == place


@pytest.mark.parametrize(
    "text", ["", "tcp:4242", "udp:", "udp:0", "udp:65536", "udp:host:x", "udp:4242:4242:1", "4242"]
)
def test_other_addresses_are_refused(text):
    with pytest.raises(InputError, match=r"is no tracker: give udp:PORT or udp:HOST:PORT"):
        address_of(text)
