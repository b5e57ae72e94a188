"""Photos are made by the textbook's sum, paint times shading plus lobe, with paint of two colours in blotches."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.rendering.gloss.gloss_settings import Gloss, GlossLight
from iibr_core.rendering.gloss.light_search import find_light
from iibr_core.rendering.gloss.microfacet import lobe_shares, reflected_share
from iibr_core.runtime.work import Cancelled, stoppable
from tests.iibr_core.rendering.gloss.scenes import GEOMETRY, SIZE, plane, sphere

GLOSS = Gloss(roughness=0.35)
FROM_SIDE = np.array([-0.45, -0.3, -0.84]) / np.linalg.norm([-0.45, -0.3, -0.84])


def painted(rng):
    """Blotches of two colours, in squares of 5 pixels."""
    share = rng.random((SIZE[0] // 5, SIZE[1] // 5)).repeat(5, 0).repeat(5, 1)[..., None]
    return np.array([0.3, 0.2, 0.1]) * share + np.array([0.1, 0.15, 0.3]) * (1 - share)


def lit(shape, light, strength, paint, gloss=GLOSS):
    """(linear, points, normals, mask): a photo under a light, clipped at white."""
    disparity, normals, mask = shape
    points = GEOMETRY.points(disparity)
    to_eye = -points / np.linalg.norm(points, axis=-1, keepdims=True)
    lobe = np.zeros(SIZE)
    for place in np.ndindex(*SIZE):
        ray = map(float, (*normals[place], *to_eye[place], *light))
        lobe[place] = mask[place] * reflected_share(*ray, *gloss.lobe_widths, gloss.reflectance)
    shading = 0.2 + 0.8 * np.maximum(normals @ light, 0)
    linear = paint * shading[..., None] + strength / lobe.max() * lobe[..., None]
    return np.minimum(linear, 1).astype(np.float32), points, normals, mask.astype(np.float32)


def round_thing():
    return sphere()


def flat_thing():
    disparity, normal = plane((0.15, 0.1, -1))
    return disparity, np.broadcast_to(normal, (*SIZE, 3)).copy(), np.ones(SIZE)


def degrees_apart(a, b):
    return np.degrees(np.arccos(np.clip(np.dot(a, b), -1, 1)))


@pytest.mark.parametrize("strength", [0.3, 3.0])
def test_the_light_of_a_sphere_is_found_behind_blotches_clipped_or_not(strength):
    found = find_light(GLOSS, *lit(round_thing(), FROM_SIDE, strength, painted(np.random.default_rng(0))))
    assert degrees_apart(found, FROM_SIDE) < 1


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_it_is_found_where_the_roughness_given_is_another(factor):
    gloss = replace(GLOSS, roughness=factor * GLOSS.roughness)
    found = find_light(gloss, *lit(round_thing(), FROM_SIDE, 0.5, painted(np.random.default_rng(1))))
    assert degrees_apart(found, FROM_SIDE) < 3


def test_the_light_of_a_plane_is_found_from_the_place_of_its_highlight():
    shape = flat_thing()
    normal, eye = shape[1][0, 0], np.array([0.1, 0.05, -1]) / np.linalg.norm([0.1, 0.05, -1])
    light = 2 * (normal @ eye) * normal - eye
    found = find_light(GLOSS, *lit(shape, light, 0.5, painted(np.random.default_rng(2))))
    assert degrees_apart(found, light) < 1


@pytest.mark.parametrize("shape", [round_thing, flat_thing])
@pytest.mark.parametrize("seed", range(4))
def test_a_matt_photo_has_no_light_of_its_own(shape, seed):
    assert find_light(GLOSS, *lit(shape(), FROM_SIDE, 0.0, painted(np.random.default_rng(seed)))) is None


@pytest.mark.parametrize(("strength", "is_seen"), [(0.015, False), (0.03, True)])
def test_a_sheen_of_less_than_two_hundredths_of_white_is_no_highlight(strength, is_seen):
    paint = np.full((*SIZE, 3), 0.2) * [1, 0.8, 0.6]
    assert (find_light(GLOSS, *lit(round_thing(), FROM_SIDE, strength, paint)) is not None) == is_seen


@pytest.mark.parametrize("seed", [0, 2])
def test_a_bright_blotch_of_grey_paint_is_no_light(seed):
    """White light leaves its colour, too; but a lobe explains less than half of it."""
    blotches = np.random.default_rng(seed).random((SIZE[0] // 20, SIZE[1] // 20)).repeat(20, 0).repeat(20, 1)
    grey = np.repeat(0.1 + 0.5 * blotches[..., None], 3, -1)
    assert find_light(GLOSS, *lit(flat_thing(), FROM_SIDE, 0.0, grey)) is None


@pytest.mark.parametrize("value", [0.0, 0.5, 1.0])
def test_a_photo_of_one_colour_or_a_surface_of_a_few_pixels_has_none(value):
    _, points, normals, mask = lit(round_thing(), FROM_SIDE, 0.0, np.zeros((*SIZE, 3)))
    even = np.full((*SIZE, 3), value, np.float32)
    assert find_light(GLOSS, even, points, normals, mask) is None
    assert find_light(GLOSS, even, points, normals, np.zeros_like(mask)) is None
    few = np.zeros_like(mask)
    few[20:26, 30:36] = 1
    assert find_light(GLOSS, even, points, normals, few) is None


def test_a_search_that_is_not_wanted_any_more_ends():
    photo = lit(round_thing(), FROM_SIDE, 0.5, painted(np.random.default_rng(0)))
    with pytest.raises(Cancelled), stoppable(lambda: True):
        find_light(GLOSS, *photo)


def test_shares_of_many_places_are_those_of_each():
    rng = np.random.default_rng(3)
    normals, to_eye, light = (rng.normal(size=shape).astype(np.float32) for shape in ((9, 3), (9, 3), (3,)))
    for vectors in (normals, to_eye, light):
        vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    widths = replace(GLOSS, light=GlossLight(radius_deg=9.0)).lobe_widths
    singly = [reflected_share(*map(float, (*n, *e, *light)), *widths, 0.3) for n, e in zip(normals, to_eye)]
    assert np.allclose(lobe_shares(normals, to_eye, light, *widths, 0.3), singly, rtol=1e-4, atol=1e-6)
