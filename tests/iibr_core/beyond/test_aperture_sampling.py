"""Cameras spread over the aperture: as wide as it is however few, all over it, and never beyond the views."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from iibr_core.beyond.aperture_sampling import aperture_points, open_area
from iibr_core.beyond.optics import ApertureMask, ApertureShape

CROSS = ApertureShape("mask", mask=ApertureMask("cross", 3, 3, bytes([0, 255, 0, 255, 255, 255, 0, 255, 0])))
CORNER = ApertureShape("mask", mask=ApertureMask("corner", 2, 2, bytes([255, 255, 255, 0])))
DISC = ApertureShape()
FROM_GEOMETRY = [
    (DISC, (0.0, 0.0), 1 / 4, np.pi),
    (ApertureShape("polygon", blades=6), (0.0, 0.0), (2 + np.cos(2 * np.pi / 6)) / 12, 3 * np.sin(2 * np.pi / 6)),
    (ApertureShape("polygon", blades=3), (0.0, 0.0), (2 + np.cos(2 * np.pi / 3)) / 12, 1.5 * np.sin(2 * np.pi / 3)),
    (ApertureShape("ring", ring_inner=0.5), (0.0, 0.0), (1 + 0.5**2) / 4, np.pi * 0.75),
    (CROSS, (0.0, 0.0), (2 / 3) ** 2 * (1 / 12 + 2 / 5), 4 * 5 / 9),
    (CORNER, (-1 / 6, -1 / 6), 1 / 3 - 1 / 36, 3.0),
]
"""Shape; for a radius of 1: centre (t, s), second moment about it per axis, and area."""
UNLIMITED = 99.0


def union(shape: ApertureShape, diameter: float, count: int, passes: int) -> NDArray[np.float64]:
    return np.concatenate([aperture_points(shape, diameter, UNLIMITED, count, k) for k in range(passes)])


@pytest.mark.parametrize(("shape", "centre", "moment", "area"), FROM_GEOMETRY)
@pytest.mark.parametrize("diameter", [0.3, 3.0])
@pytest.mark.parametrize("count", [4, 12, 64])
@pytest.mark.parametrize("passes", [1, 5])
def test_cameras_have_centre_and_width_of_the_opening(
    shape: ApertureShape,
    centre: tuple[float, float],
    moment: float,
    area: float,
    diameter: float,
    count: int,
    passes: int,
) -> None:
    points, radius = union(shape, diameter, count, passes), diameter / 2
    # The first pass has them exactly, and with those that follow them the more cameras there are.
    slack = 0.0 if passes == 1 else 0.6 / count
    assert points.mean(0) == pytest.approx(radius * np.array(centre), abs=(0.01 + slack) * radius)
    tolerance = 0.02 + 2 * slack
    assert np.mean((points - points.mean(0)) ** 2) == pytest.approx(radius**2 * moment, rel=tolerance)
    assert open_area(shape, diameter, UNLIMITED) == pytest.approx(radius**2 * area, rel=0.03)


def test_each_camera_may_be_blurred_by_its_share() -> None:
    """Cameras and blur together are as wide as the opening."""
    for cell in (0.0, 0.5, 1.0):
        points = aperture_points(DISC, 3.0, UNLIMITED, 12, 0, cell)
        assert np.mean(points**2) + cell**2 / 12 == pytest.approx(1.5**2 / 4, rel=0.01)
    assert np.abs(aperture_points(DISC, 3.0, UNLIMITED, 12, 0, 99.0)).max() < 1e-9, "never wider than all of it"


def test_an_empty_mask_is_a_pinhole_in_the_middle() -> None:
    closed = ApertureShape("mask", mask=ApertureMask("closed", 2, 2, bytes(4)))
    assert np.array_equal(aperture_points(closed, 3.0, UNLIMITED, 20, 1, 0.3), np.zeros((1, 2)))
    assert open_area(closed, 3.0, UNLIMITED) == 0


@pytest.mark.parametrize("diameter", [7.5, 20.0, 99.0, 1e30])
def test_an_aperture_beyond_the_grid_is_the_grids_square(diameter: float) -> None:
    points = np.concatenate([aperture_points(DISC, diameter, 5.0, 64, k) for k in range(4)])
    assert np.mean(points**2) == pytest.approx(5**2 / 12, rel=0.02)
    assert np.abs(points).max() < 2.5 + 0.15
    assert open_area(DISC, diameter, 5.0) == pytest.approx(25, rel=0.02)


def gap(points: NDArray[np.float64]) -> float:
    """Distance from the place in the disc of radius 1 that is farthest from any point, over that between points of a
    square lattice as dense.
    """
    places = (np.arange(80) + 0.5) / 40 - 1
    every = np.stack(np.meshgrid(places, places), -1).reshape(-1, 2)
    inside = every[np.hypot(*every.T) < 1]
    return float(np.hypot(*(inside[:, None] - points).T).min(0).max() / np.sqrt(np.pi / len(points)))


@pytest.mark.parametrize("count", [4, 6, 8, 12, 32])
def test_cameras_lie_all_over_the_opening(count: int) -> None:
    """Cameras of one pass, and of all; random ones would leave gaps of 1.7."""
    assert max(gap(aperture_points(DISC, 2.0, UNLIMITED, count, k)) for k in range(8)) < 1.15
    assert gap(union(DISC, 2.0, count, 12)) < 2.0
