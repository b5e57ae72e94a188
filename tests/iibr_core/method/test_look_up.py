import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.method.candidates import Candidates, find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import KEYS_A, MIN_TAP_WEIGHT, cubic_on_surface, look_up
from iibr_core.method.rays import RaySet
from iibr_core.surfaces import SAME_SURFACE_PX
from iibr_core.types import ImageSize, ViewOffset
from tests.iibr_core.method.ray_sets import ray_set


def keys_slowly(distance):
    d, a = abs(distance), KEYS_A
    if d <= 1:
        return (a + 2) * d**3 - (a + 3) * d**2 + 1
    return a * d**3 - 5 * a * d**2 + 8 * a * d - 4 * a if d < 2 else 0.0


def cubic_slowly(image, x, y):
    height, width, _ = image.shape
    total = np.zeros(3)
    for v in range(int(np.floor(y)) - 1, int(np.floor(y)) + 3):
        for u in range(int(np.floor(x)) - 1, int(np.floor(x)) + 3):
            tap = image[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)]
            total += keys_slowly(u - x) * keys_slowly(v - y) * tap
    return total


def cubic_on_surface_slowly(image, surface, x, y, d, parallax):
    height, width = surface.shape
    rows, columns = (int(np.floor(at)) + np.arange(-1, 3) for at in (y, x))
    weights = np.outer([keys_slowly(v - y) for v in rows], [keys_slowly(u - x) for u in columns]).ravel()
    at = np.ix_(np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1))
    colors, is_own = image[at].reshape(-1, 3), (np.abs(surface[at] - d) <= SAME_SURFACE_PX / parallax).ravel()
    if is_own.all() or not is_own.any():
        return cubic_slowly(image, x, y)
    if weights[is_own].sum() < MIN_TAP_WEIGHT:
        v, u = (places.ravel() for places in np.broadcast_arrays(*at))
        return colors[np.argmin(np.where(is_own, (v - y) ** 2 + (u - x) ** 2, np.inf))]
    mean = weights[is_own] @ colors[is_own] / weights[is_own].sum()
    return np.clip(mean, colors[is_own].min(axis=0), colors[is_own].max(axis=0))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_near_edges_pixels_of_the_own_surface_count_as_a_slow_twin_says(share):
    random = np.random.default_rng(4)
    image = random.random((9, 11, 3)).astype(np.float32)
    surface = np.where(random.random((9, 11)) < share, 1.0, 3.0).astype(np.float32)
    surface[4, 5] = np.nan
    for y, x in random.uniform(-0.5, (8.5, 10.5), (300, 2)):
        found = cubic_on_surface(image[None], surface[None], 0, x, y, 1.1, 2.0)
        assert found == pytest.approx(cubic_on_surface_slowly(image, surface, x, y, 1.1, 2.0), abs=1e-4)


def test_surfaces_that_share_a_pixel_blend_in_linear_light():
    red, blue = np.float32([0.9, 0.1, 0.1]), np.float32([0.1, 0.1, 0.9])
    rays = RaySet(2, ImageSize(3, 3))
    full = np.ones((3, 3), np.float32)
    for color, disparity in ((red, 1.0), (blue, 0.0)):
        rays.add(ViewOffset(0.0, 0.0), np.tile(color, (3, 3, 1)), np.float32(disparity) * full, full)
    half, slots = np.full((2, 1, 3), 0.5, np.float32), np.tile(np.uint8([[[0]], [[1]]]), (1, 1, 3))
    number, smooth = np.full((1, 3), 2, np.uint8), np.zeros((1, 1), np.bool_)
    candidates = Candidates(ViewOffset(0.0, 0.0), 1, number, half, np.float32(slots == 0), slots, smooth)
    light = (linear_from_srgb(red) + linear_from_srgb(blue)) / 2
    assert look_up(rays, candidates, half)[0][0, 1] == pytest.approx(srgb_from_linear(light), abs=1e-5)


def test_no_colour_crosses_a_depth_edge():
    image = np.zeros((8, 12, 3), np.float32)
    image[:, 6:] = 1.0
    disparity = np.where(np.arange(12) < 6, 0.0, 3.0) * np.ones((8, 1))
    rays = ray_set(disparity, colors=image)
    candidates = find_candidates(rays, ViewOffset(0.0, 0.5), (0, 8))
    colors, found, _ = look_up(rays, candidates, closed_form(candidates)[0])
    sole = closed_form(candidates)[0].max(axis=0) > 0.999
    assert colors[sole & (found == 0)].max() == 0
    assert colors[sole & (found == 3)].min() == 1
