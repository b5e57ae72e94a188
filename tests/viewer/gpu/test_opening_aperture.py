"""The aperture from closed to as wide as the grid: nothing jumps, and every picture is the one of brute force."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.color import linear_from_srgb
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import PhotoLike, first_frame, psnr, settled, sharpness

GRID = GridShape(5, 5)
BETWEEN = ViewOffset(0.3, 0.2)
PHOTO = PhotoLike(width=160, height=120, background=-4.0, foreground=3.0, radius_px=30.0)
ON_DISC, ON_WALL = Optics(focus_disparity=3.0), Optics(BETWEEN, focus_disparity=-4.0)


def opened(renderer, optics, draw, diameters):
    PHOTO.fill(renderer, GRID)
    return [draw(renderer, replace(optics, aperture_diameter=float(diameter)), PHOTO) for diameter in diameters]


@pytest.mark.parametrize(("optics", "draw"), [(ON_DISC, first_frame), (ON_WALL, settled)])
def test_what_is_out_of_focus_becomes_softer_and_softer(renderer, optics, draw):
    steps = [sharpness(image) for image in opened(renderer, optics, draw, np.linspace(0, 5, 6))]
    assert max(after / before for before, after in pairwise(steps)) < 1.01
    assert steps[-1] < 0.8 * steps[0]


@pytest.mark.parametrize(("optics", "diameter"), [(ON_DISC, 3.0), (ON_WALL, 0.8)])
def test_the_first_frame_is_near_the_settled_picture(renderer, optics, diameter):
    PHOTO.fill(renderer, GRID)
    optics = replace(optics, aperture_diameter=diameter)
    first, last = first_frame(renderer, optics, PHOTO), settled(renderer, optics, PHOTO)
    assert psnr(first, last) >= 34
    light = [float(linear_from_srgb(image / 255).mean()) for image in (first, last)]
    assert light[0] == pytest.approx(light[1], abs=0.003)
