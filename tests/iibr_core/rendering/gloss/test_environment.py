from math import pi

import numpy as np
import pytest

from iibr_core.rendering.gloss.environment import prefilter_environment


def directions(height):
    v, u = np.mgrid[:height, : 2 * height] + 0.5
    polar, azimuth = pi * v / height, pi * u / height
    return np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1), np.sin(
        polar
    )


def plain_mean(light, alpha, place):
    """The mean of a picture under GGX's lobe about one direction, from all of its pixels."""
    towards, areas = directions(light.shape[0])
    cosine = (towards * towards[place]).sum(-1)
    half = np.cos(np.arccos(np.clip(cosine, -1, 1)) / 2)
    weight = np.where(cosine > 0, cosine * areas / (half**2 * (alpha**2 - 1) + 1) ** 2, 0)
    return (light * weight[..., None]).sum((0, 1)) / weight.sum()


def test_it_is_the_mean_under_the_lobe():
    roughness = 0.7
    light = np.random.default_rng(0).uniform(0, 4, (16, 32, 3)).astype(np.float32)
    smooth = prefilter_environment(light, roughness)
    assert smooth.shape == light.shape
    for place in ((0, 0), (7, 3), (8, 31), (15, 16)):
        assert np.allclose(smooth[place], plain_mean(light, roughness**2, place), rtol=0.12)


def test_a_single_light_is_seen_as_the_lobe_itself():
    roughness, light = 0.7, np.zeros((16, 32, 3), np.float32)
    light[5, 9] = 100.0
    smooth = prefilter_environment(light, roughness)
    for place in ((5, 9), (5, 12), (8, 9), (2, 20), (11, 3)):
        assert np.allclose(smooth[place], plain_mean(light, roughness**2, place), rtol=0.02)


def test_upside_down_or_turned_it_is_the_same_picture():
    light = np.random.default_rng(1).uniform(0, 4, (16, 32, 3)).astype(np.float32)
    smooth = prefilter_environment(light, 0.6)
    np.testing.assert_allclose(prefilter_environment(light[::-1].copy(), 0.6), smooth[::-1], rtol=1e-4)
    np.testing.assert_allclose(prefilter_environment(light[:, ::-1].copy(), 0.6), smooth[:, ::-1], rtol=1e-4)
    np.testing.assert_allclose(prefilter_environment(np.roll(light, 5, axis=1), 0.6), np.roll(smooth, 5, 1), rtol=1e-4)


def test_a_mirror_sees_the_picture_itself():
    light = np.random.default_rng(0).uniform(0, 4, (32, 64, 3)).astype(np.float32)
    assert np.array_equal(prefilter_environment(light, 0.0), light)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
def test_an_even_sky_stays_even_and_wild_pixels_count_as_black(roughness):
    light = np.full((20, 40, 3), 0.5, np.float32)
    assert np.allclose(prefilter_environment(light, roughness), 0.5, atol=1e-5)
    light[3, 3], light[4, 4], light[5, 5] = np.nan, np.inf, -1
    assert np.isfinite(prefilter_environment(light, roughness)).all()


def test_a_picture_of_one_pixel_serves():
    assert np.allclose(prefilter_environment(np.full((1, 1, 3), 2.0, np.float32), 0.5), 2.0, atol=1e-5)


def test_a_large_picture_that_is_smoothed_is_made_smaller_first():
    light = np.ones((512, 1024, 3), np.float32)
    assert prefilter_environment(light, 0.11).shape == (256, 512, 3)
    assert prefilter_environment(light, 0.05).shape == (512, 1024, 3), "as sharp as it is"
