"""The hard cases of the design, section 8, on the graphics card: extreme apertures, eyes, disparities and grids.

Expected everywhere: no GL error (the `gl` fixture looks), and a picture within the range of what the views show.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from iibr_core.beyond.optics import Optics
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.lens_limits import eye_limits
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes, open_field, open_views

SCENE = TwoPlanes(width=48, height=32, radius_px=8.0)
SIZE = SCENE.width, SCENE.height
GRID = GridShape(3, 3)
COLOR = (10, 130, 250)


def picture(renderer, optics, size=SIZE):
    renderer.render(optics, size)
    return renderer.read_image().astype(int)


def open_constant(renderer, disparity, size=SIZE):
    """A field of one colour whose half is near, the other far."""
    width, height = size
    values = np.where(np.arange(width) < width // 2, disparity, -disparity)
    open_views(renderer, GRID, np.full((height, width, 3), COLOR, np.uint8), values)


@pytest.mark.parametrize("disparity", [0.0, 500.0, 3e38])
def test_disparities_of_any_size(renderer, disparity):
    """All equal (0), larger than the image, beyond half floats: through a pinhole one colour stays one colour.

    Through a lens too, up to some 2000 px of defocus a view step; half floats then lose light of what is behind.
    """
    open_constant(renderer, disparity)
    for focus, diameter in itertools.product((0.0, disparity), (0.0, 2.5) if disparity <= 500 else (0.0,)):
        optics = Optics(ViewOffset(0.3, -0.6), focus_disparity=focus, aperture_diameter=diameter)
        assert np.abs(picture(renderer, optics) - COLOR).max() <= 1, optics


eyes = st.floats(*eye_limits(3))


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.builds(
        Optics,
        st.builds(ViewOffset, eyes, eyes),
        st.floats(-1, 1),
        st.floats(-5, 5),
        st.floats(0, 10),
        st.tuples(st.floats(-40, 40), st.floats(-40, 40)),
        st.floats(0, 3),
    )
)
@example(Optics(dolly=5e-324))
def test_refocus_of_a_constant_photo_is_constant(renderer, optics):
    """Whatever the eye, dolly, focus, tilt, range and aperture that the viewer allows: weights are weights."""
    if renderer.field is None:
        open_constant(renderer, 4.0)
    assert np.abs(picture(renderer, optics) - COLOR).max() <= 1


@pytest.mark.parametrize("size", [(1, 1), (1, 13), (7, 13)])
def test_tiny_thin_and_prime_sized_views(renderer, size):
    open_constant(renderer, 2.0, size)
    for optics in (Optics(ViewOffset(0.5, -0.5)), Optics(aperture_diameter=3.0, focus_disparity=1.0)):
        for drawn in (size, (5, 3), (64, 40)):
            assert np.abs(picture(renderer, optics, drawn) - COLOR).max() <= 1


def test_float16_sums_of_289_views(renderer):
    """Light far beyond white, summed over 17x17 half-float views, does not drift: within two steps of 8 bits."""
    grid, light = GridShape(17, 17), 3.0
    open_field(renderer, grid, 8, 6, hdr=True, with_disparity=False)
    encoded = srgb_from_linear(np.full((6, 8, 3), light)).astype(np.float16)
    for at in np.ndindex(17, 17):
        renderer.field.upload(*at, encoded, None)
    optics = Optics(aperture_diameter=40.0, exposure_stops=math.log2(0.5 / light))
    expected = 255 * srgb_from_linear(np.array(0.5))
    assert np.abs(picture(renderer, optics, (8, 6)) - expected).max() <= 2
    linear = renderer.converged_picture(RenderSettings(replace(optics, exposure_stops=0.0), (8, 6), is_linear=True))
    assert linear == pytest.approx(float(linear_from_srgb(encoded)[0, 0, 0]), rel=2e-3)


def test_a_one_pixel_wire(renderer):
    """Between stored views it is still there, about as bright and as wide as it is."""
    width, height, foreground = 40, 24, 3.0
    open_field(renderer, GRID, width, height)
    for row, column in np.ndindex(3, 3):
        at = round(20 - foreground * (column - 1))
        colors, disparity = np.full((height, width, 3), 30, np.uint8), np.zeros((height, width), np.float32)
        colors[:, at], disparity[:, at] = 220, foreground
        renderer.field.upload(row, column, colors, disparity)
    for s in (0.0, 1.0, 1 / 3):
        row = picture(renderer, Optics(ViewOffset(0.0, s)), (width, height))[12, :, 0]
        assert row[round(20 - foreground * s)] > 180, s
        assert (row > 100).sum() <= 2
