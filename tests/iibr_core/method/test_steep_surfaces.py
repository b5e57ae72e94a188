"""Rays that one steep surface joins, against a slow twin; steep planes stay closed and exact."""

import numpy as np
import pytest

from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.rays import RaySet
from iibr_core.method.steep_surfaces import BELOW, MIN_RUN, RIGHT, STEEP_SHARE, is_joined, join_steep_rays
from iibr_core.surfaces import SLOPE_SHARE
from iibr_core.types import ViewOffset, image_size

STEP = 0.5


def join_slowly(disparity):
    """Line by line: a step is a surface's if MIN_RUN steps on one side follow it, each as large as the last."""
    connected = np.zeros(disparity.shape, np.uint8)
    for bit, lines, marked in ((RIGHT, disparity, connected), (BELOW, disparity.T, connected.T)):
        for line, marks in zip(lines, marked):
            steps = np.diff(line)
            for x, own in enumerate(steps):
                for side in (steps[x : x + MIN_RUN + 1], steps[max(x - MIN_RUN, 0) : x + 1]):
                    sizes = np.abs(side)
                    alike = np.abs(np.diff(side)) <= SLOPE_SHARE * np.maximum(sizes[1:], sizes[:-1])
                    if abs(own) > STEEP_SHARE * STEP and len(side) > MIN_RUN and alike.all():
                        marks[x] |= bit
    return connected


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.5])
@pytest.mark.parametrize("unknown", [0.0, 0.03])
def test_joined_rays_against_a_slow_twin(noise, unknown):
    random = np.random.default_rng(2)
    y, x = np.mgrid[:24, :31]
    disparity = (0.4 * x - 0.7 * y + noise * random.normal(size=y.shape)).astype(np.float32)
    disparity[:, 20:] += 6
    disparity[random.random(disparity.shape) < unknown] = np.nan
    connected = join_steep_rays(disparity, STEP)
    assert (connected == join_slowly(disparity)).all()
    assert (connected > 0).mean() > 0.8 or noise > 0
    either = is_joined(connected)
    assert either[1:, 1:].sum() == sum(
        bool(connected[y, x] or connected[y, x - 1] & RIGHT or connected[y - 1, x] & BELOW)
        for y in range(1, 24)
        for x in range(1, 31)
    )


def ray_set(disparity, farthest=1.0):
    rays = RaySet(1, image_size(disparity), farthest)
    rays.add(ViewOffset(0.0, 0.0), np.zeros((*disparity.shape, 3), np.float32), disparity, np.ones_like(disparity))
    return rays


@pytest.mark.parametrize("slope", [-3.0, -0.9, -0.6, -0.3, 0.3, 0.6, 0.8])
@pytest.mark.parametrize("along", ["rows", "columns"])
def test_a_steep_plane_is_one_closed_surface_of_exact_disparity(slope, along):
    disparity = np.tile(slope * (np.arange(60, dtype=np.float32) - 30), (60, 1))
    offset, turn = (ViewOffset(0.0, 1.0), np.array) if along == "rows" else (ViewOffset(1.0, 0.0), np.transpose)
    found = find_candidates(ray_set(np.ascontiguousarray(turn(disparity))), offset, (0, 60))
    # d = slope (x + d - 30), seen at x
    x = np.arange(60)
    exact = slope * (x - 30) / (1 - slope)
    source = x + exact
    inside = (source > 4) & (source < 55) & (x > 2) & (x < 57)
    assert inside.sum() > 8
    count, disparities = turn(found.number), turn(found.disparity[0])
    weights = turn(closed_form(found)[1])
    assert (count[20:40, inside] == 1).all()
    assert weights[20:40, inside] == pytest.approx(1, abs=1e-3)
    assert disparities[20:40, inside] == pytest.approx(np.broadcast_to(exact[inside], (20, inside.sum())), abs=0.02)


def test_a_steep_surface_is_torn_where_it_ends():
    """Behind a steep slope's last ray lies the wall: between both nothing is known."""
    x = np.arange(80, dtype=np.float32)
    disparity = np.tile(np.where(x < 40, 0.8 * (40 - x), -9.0), (12, 1)).astype(np.float32)
    found = find_candidates(ray_set(disparity), ViewOffset(0.0, 1.0), (0, 12))
    shown = closed_form(found)[1][6]
    # The slope's last ray, 39, lands on 38.2; the wall's first on 49.
    assert shown[41:48] == pytest.approx(0)
    assert shown[20:38] == pytest.approx(1, abs=1e-3)
