import numpy as np
import pytest

from iibr_core.rendering.gloss.separation import reflected_light, separate_light
from tests.iibr_core.rendering.gloss.scenes import SIZE, sphere


def shaded_sphere(color):
    _, normals, hit = sphere()
    rng = np.random.default_rng(2)
    albedo = rng.uniform(0.25, 0.35, (*SIZE, 3))
    linear = albedo * np.maximum(-normals[..., 2:], 0)
    lobe = np.exp(-((normals[..., 0] + 0.3) ** 2 + (normals[..., 1] + 0.2) ** 2) / 0.02) * hit
    return (linear + lobe[..., None] * color).astype(np.float32), normals, hit.astype(np.float32), lobe, linear


def test_a_lights_colour_is_found_beside_texture_and_shading():
    color = np.array([0.5, 0.4, 0.2])
    shown, normals, mask, lobe, linear = shaded_sphere(color)
    found, reflected = separate_light(shown, normals, mask, lobe.astype(np.float32))
    assert np.allclose(found, color, rtol=0.1)
    assert np.abs(shown - reflected - linear)[mask > 0].max() < 0.06


def test_a_light_that_clips_the_photo_is_found_from_where_it_does_not():
    color = np.array([2.0, 2.0, 2.0])
    shown, normals, mask, lobe, linear = shaded_sphere(color)
    found, reflected = separate_light(np.minimum(shown, 1), normals, mask, lobe.astype(np.float32))
    assert np.allclose(found, color, rtol=0.1)
    matt = np.minimum(shown, 1) - reflected
    assert (matt / linear)[lobe > 0.3].min() > 0.5  # no dark spot is left


def test_a_matt_photo_shows_no_light():
    shown, normals, mask, lobe, _ = shaded_sphere(np.zeros(3))
    found, reflected = separate_light(shown, normals, mask, lobe.astype(np.float32))
    assert found.max() < 0.02
    assert reflected.max() < 0.02
    assert not reflected_light(shown, normals, mask).any()


def test_highlights_are_told_from_the_matt_part_without_knowing_the_light():
    color = np.array([0.9, 0.9, 0.9])
    shown, normals, mask, lobe, _ = shaded_sphere(color)
    reflected = reflected_light(shown, normals, mask)
    assert reflected.max() == pytest.approx(0.9, abs=0.2)
    assert not reflected[lobe < 0.02].any()


@pytest.mark.parametrize("mask", [np.zeros(SIZE, np.float32), np.full(SIZE, 0.4, np.float32)])
def test_an_empty_mask_has_nothing_reflected(mask):
    shown, normals, _, lobe, _ = shaded_sphere(np.ones(3))
    assert not reflected_light(shown, normals, mask).any()
    found, reflected = separate_light(shown, normals, mask, lobe.astype(np.float32))
    assert not found.any()
    assert not reflected.any()
