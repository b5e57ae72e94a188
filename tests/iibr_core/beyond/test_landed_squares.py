"""Samples of a target's pixels and rays that land as squares, against a slow twin."""

import numpy as np
import pytest

from iibr_core.beyond.free_view import target_from_photo
from iibr_core.beyond.landed_squares import CORNERS, SAMPLES, draw_rays, rows_landed_on
from iibr_core.method.rays import rays_of_photo
from tests.iibr_core.beyond.test_free_view import about, camera


def sealed_step(matrix, x, y, d):
    """Return the step of disparity that moves where a pixel lands by three quarters of the size it lands at."""

    def landed(x, y, d):
        place = matrix @ (x, y, 1.0, d)
        return place[:2] / place[2]

    here, little = landed(x, y, d), 1e-6
    moved = np.abs(landed(x, y, d + little) - here).max()
    return 0.75 * max(np.abs(landed(x + i, y + j, d) - here).max() for i, j in ((little, 0), (0, little))) / moved


def drawn_slowly(disparity, matrix, size, rounding):
    """Return what `draw_rays` gives for one image: every sample asks every square of every pixel.

    rounding: so large steps are none.
    """
    height, width = disparity.shape
    nearest = np.full((SAMPLES * size.height, SAMPLES * size.width), -np.inf)
    at = (np.arange(SAMPLES * max(size)) + 0.5) / SAMPLES - 0.5
    for y, x in np.ndindex(height, width):
        corners, one_surface = [], max(sealed_step(matrix, x, y, disparity[y, x]), rounding)
        for j, i in CORNERS:
            # The pixels around the corner that steps below one_surface lead to from this one.
            alike, ways = {(y, x)}, [(y, x)]
            while ways:
                v, u = ways.pop()
                for next_v, next_u in ((y + j if v == y else y, u), (v, x + i if u == x else x)):
                    inside = 0 <= next_v < height and 0 <= next_u < width and (next_v, next_u) not in alike
                    if inside and abs(disparity[next_v, next_u] - disparity[v, u]) <= one_surface:
                        alike.add((next_v, next_u))
                        ways.append((next_v, next_u))
            mean = np.mean([disparity[place] for place in alike])
            landed = matrix @ (x + 0.5 * i, y + 0.5 * j, 1.0, mean)
            corners.append(landed[[0, 1, 3]] / landed[2])
        for b in (1, 2):
            triangle = np.array([corners[0], corners[b], corners[b + 1]])
            basis = np.vstack([triangle[:, :2].T, np.ones(3)])
            if np.linalg.det(basis) < 1e-9:
                continue
            for v, u in np.ndindex(nearest.shape):
                share = np.linalg.solve(basis, (at[u], at[v], 1.0))
                if share.min() >= -1e-6:
                    nearest[v, u] = max(nearest[v, u], share @ triangle[:, 2])
    return nearest


@pytest.mark.parametrize(("turn", "rounding"), [(about(2, 30.0), 0.0), (about(1, -8.0) @ about(0, 5.0), 0.9)])
def test_samples_see_what_a_slow_twin_sees(turn, rounding):
    rng = np.random.default_rng(1)
    disparity = np.where(rng.random((6, 7)) < 0.3, 2.0, 1.0) + rng.uniform(0, 0.3, (6, 7))
    photo = camera(6, 7, 8.0)
    target = camera(4, 5, 6.0, (0.2, -0.1, 0.15), turn)
    matrix = target_from_photo(photo, target, 8.0)
    rays = rays_of_photo(np.zeros((6, 7, 3), np.float32), disparity.astype(np.float32), 1.0, 0)
    flat = tuple(map(float, matrix.ravel()))
    landing = [rows_landed_on(rays, 0, matrix)]
    nearest, source = draw_rays(rays, [flat], landing, 0.5, rounding, (0, 4), 5)
    slow = drawn_slowly(rays.arrays.disparity[0], matrix, target.size, rounding)
    # Samples on the very side of a triangle belong to either.
    differ = ~np.isclose(nearest, slow, atol=1e-4)
    assert differ.mean() < 0.01
    np.testing.assert_array_equal(source == 0, np.isneginf(nearest))
