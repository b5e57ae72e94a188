import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.method.candidates import Candidates, find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import look_up
from iibr_core.method.rays import RaySet
from iibr_core.types import ImageSize, ViewOffset
from tests.iibr_core.method.ray_sets import ray_set


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
