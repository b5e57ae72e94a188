"""Maps that are turned, mirrored or raised, and photos whose channels are exchanged, are refined alike."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, maximum_filter

from iibr_core.depth.edges.refine import refine
from iibr_core.method.flying_pixels import measure_detail
from iibr_core.method.mixed_pixels import split_mixed_pixels
from tests.iibr_core.scenes import smooth_texture

HEIGHT, WIDTH, SIGMA, EDGE = 44, 60, 1.5, 0.3
HEIGHTS = np.float32([0, 2, 1.25, 3, 2.5])
TURNS = {
    "left and right": lambda values: values[:, ::-1],
    "up and down": lambda values: values[::-1],
    "rows and columns": lambda values: values.swapaxes(0, 1),
}


def things():
    """Return the thing that each pixel of a map shows: a wall, a box, a disc and two wires, one of them aslant."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    thing = np.zeros((HEIGHT, WIDTH), int)
    thing[8:20, 6:24] = 1
    thing[(y - 30) ** 2 + (x - 42) ** 2 < 81] = 2
    thing[:, 30:33], thing[abs(x - y - 8) < 2] = 3, 4
    return thing


def scene():
    """Return a photo (H, W, 3) of these and their map (H, W), on slants, blurred."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    thing = things()
    heights = HEIGHTS[thing] + 0.004 * x - 0.006 * y
    colors = np.float32([(0.2, 0.3, 0.5), (0.8, 0.4, 0.2), (0.3, 0.7, 0.3), (0.9, 0.9, 0.2), (0.6, 0.1, 0.6)])[thing]
    photo = colors + np.random.default_rng(1).normal(0, 0.02, colors.shape)
    return photo.astype(np.float32), gaussian_filter(heights, SIGMA, mode="nearest").astype(np.float32)


def faulty_maps():
    """Return a blurred and a dilated map of the things."""
    return scene()[1], maximum_filter(HEIGHTS[things()], 3)


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_a_turned_map_is_refined_alike(turn):
    """Ties may differ."""
    photo = scene()[0]
    for given in faulty_maps():
        expected = turn(refine(photo, given))
        found = refine(np.ascontiguousarray(turn(photo)), np.ascontiguousarray(turn(given)))
        assert (abs(found - expected) > 0.05).mean() < 0.02
        assert (abs(expected - turn(given)) > 0.05).mean() > 0.02, "something is refined"


def grey_in_one_channel(photo, channel):
    """Return the photo's brightness in one channel, grey in the others."""
    shown = np.full_like(photo, 0.5)
    shown[..., channel] = photo.mean(axis=2)
    return shown


@pytest.mark.parametrize("channel", [1, 2])
def test_all_channels_count_alike(channel):
    photo = scene()[0] + 0.1 * smooth_texture(HEIGHT, WIDTH)
    first, other = grey_in_one_channel(photo, 0), grey_in_one_channel(photo, channel)
    for given in faulty_maps():
        expected = refine(first, given)
        np.testing.assert_allclose(refine(other, given), expected, atol=1e-5)
        assert (expected != given).any()
    np.testing.assert_array_equal(measure_detail(other), measure_detail(first))
    exact = HEIGHTS[things()]
    split, expected = split_mixed_pixels(other, exact, EDGE), split_mixed_pixels(first, exact, EDGE)
    np.testing.assert_allclose(split[3], expected[3], atol=1e-5)
    np.testing.assert_allclose(split[0][..., channel], expected[0][..., 0], atol=1e-5)
    assert (expected[3] > 0).sum() > 50
