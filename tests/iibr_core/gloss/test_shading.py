from dataclasses import replace

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.microfacet import reflected_share
from iibr_core.gloss.settings import Gloss, GlossLight, GlossSurface
from iibr_core.gloss.shading import make_gloss_maps, shade, shade_views
from iibr_core.types import GridShape, ViewOffset, ViewUpdate
from tests.iibr_core.gloss.scenes import GEOMETRY, SIZE, plane, sphere

GREY = np.full((*SIZE, 3), 0.4, np.float32)
GLOSS = Gloss(roughness=0.35, light=GlossLight((-0.3, -0.3, -1)))


def maps_of(gloss, disparity, geometry=GEOMETRY, normals=None, photo=GREY):
    return make_gloss_maps(gloss.surface, photo, disparity, geometry, normals)


def shaded(gloss, maps, offset, disparity=None, photo=GREY):
    colors = photo.copy()
    shade(colors, maps.disparity if disparity is None else disparity, ViewOffset(*offset), gloss, maps)
    return colors


def plainly_shaded(gloss, maps, offset, photo):
    """The same of a flat map, whose disparity is known at every place: pixel by pixel, by the docstrings' formulas."""
    height, width = maps.mask.shape
    result = linear_from_srgb(photo)
    light, focal = gloss.light.unit_direction, maps.geometry.focal_px
    for y, x in np.ndindex(height, width):
        d = maps.disparity[y, x]
        v, u = y + d * offset[0], x + d * offset[1]
        if not (0 <= v <= height - 1 and 0 <= u <= width - 1):
            continue
        near = d - maps.geometry.infinity
        point = np.array([(u - (width - 1) / 2) / near, (v - (height - 1) / 2) / near, focal / near])
        eye = np.array([offset[1], offset[0], 0]) - point
        eye /= np.linalg.norm(eye)
        normal = maps.normals[round(v), round(u)]
        share = reflected_share(tuple(normal), tuple(eye), light, gloss.lobe)
        for c in range(3):
            result[y, x, c] += share * (gloss.light.radiance[c] - result[y, x, c])
    return srgb_from_linear(result)


@pytest.mark.parametrize("offset", [(0, 0), (1, -2)])
def test_it_is_the_lobe_at_every_pixel(offset):
    flat = np.full(SIZE, 0.75, np.float32)
    maps = maps_of(GLOSS, flat)
    inner = slice(4, -4), slice(4, -4)
    assert np.allclose(shaded(GLOSS, maps, offset)[inner], plainly_shaded(GLOSS, maps, offset, GREY)[inner], atol=1e-4)


def test_on_a_plane_the_highlight_of_a_far_light_stays_in_the_frame_of_what_is_far():
    """Its virtual image is infinitely far: it moves by the disparity of infinity, not by the surface's."""
    disparity, _ = plane((0, 0, -1))
    gloss = replace(GLOSS, light=GlossLight((0.05, 0, -1)))
    maps = maps_of(gloss, disparity)
    places = [shaded(gloss, maps, (0, s)).sum(-1).argmax() % SIZE[1] for s in (-2, 0, 2)]
    assert places[0] - places[1] == pytest.approx(2 * GEOMETRY.infinity, abs=1)
    assert places[1] - places[2] == pytest.approx(2 * GEOMETRY.infinity, abs=1)


def test_light_from_behind_changes_nothing():
    disparity, _, _ = sphere()
    gloss = replace(GLOSS, light=GlossLight((0, 0.2, 1)))
    maps = maps_of(gloss, disparity)
    facing = maps.normals[..., 2] < -0.5
    assert np.allclose(shaded(gloss, maps, (0, 0))[facing], GREY[facing], atol=1e-6)


@pytest.mark.parametrize("roughness", [0.0, 1.0])
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (6, 7)])
def test_mirrors_and_dull_surfaces_of_any_size_are_finite(roughness, shape):
    photo = np.random.default_rng(0).uniform(0, 1, (*shape, 3)).astype(np.float32)
    disparity = np.random.default_rng(1).uniform(-1, 3, shape).astype(np.float32)
    gloss = Gloss(roughness=roughness)
    maps = maps_of(gloss, disparity, SceneGeometry(8.0, 0.0), photo=photo)
    assert np.isfinite(shaded(gloss, maps, (1.5, -100.0), photo=photo)).all()


@pytest.mark.parametrize("roughness", [0.0, 1.0])
def test_a_plane_seen_edge_on_is_no_brighter_than_the_light(roughness):
    """Grazing, everything is a mirror: what is reflected replaces the paint."""
    grazing = 1.45
    disparity, normal = plane((0, -np.sin(grazing), -np.cos(grazing)))
    towards = np.array([0, -np.sin(0.2), np.cos(0.2)])
    gloss = Gloss(roughness=roughness, light=GlossLight(tuple(towards), (0.002, 0.002, 0.002), radius_deg=3.0))
    maps = maps_of(gloss, disparity, normals=np.broadcast_to(normal, (*SIZE, 3)).copy())
    light = linear_from_srgb(shaded(gloss, maps, (0, 1)))
    assert light.min() >= linear_from_srgb(GREY).min() - 1e-4
    assert light.max() <= max(gloss.light.radiance) + 1e-3


def test_what_shows_beside_a_surface_in_other_views_gets_none_of_its_gloss():
    disparity, _, hit = sphere()
    gloss = replace(GLOSS, surface=GlossSurface(farthest=0.1), reflectance=1.0)
    maps = maps_of(gloss, disparity)
    wall = np.full(SIZE, disparity[~hit].max(), np.float32)
    assert np.array_equal(shaded(gloss, maps, (0, 3), disparity=wall), GREY)


@pytest.mark.parametrize("is_marked", [True, False])
def test_views_keep_their_kind_and_those_without_disparity_or_surface_stay(is_marked):
    flat = np.full(SIZE, 0.75, np.float32)
    given = [ViewUpdate(1, 1, (GREY * 255).astype(np.uint8), flat), ViewUpdate(1, 0, GREY.astype(np.float16), None)]
    gloss = replace(GLOSS, surface=GlossSurface(strokes_only=not is_marked))
    first, second = shade_views(iter(given), gloss, maps_of(gloss, flat), GridShape(3, 3))
    assert second is given[1]
    if is_marked:
        assert first.colors.dtype == np.uint8
        assert first.colors.max() > given[0].colors.max()
    else:
        assert first is given[0]


def test_a_smaller_light_of_the_same_strength_is_brighter_and_needs_a_direction():
    wide = GlossLight(radius_deg=4.0)
    assert replace(wide, radius_deg=2.0).radiance[0] == pytest.approx(4 * wide.radiance[0], rel=0.01)
    with pytest.raises(ValueError, match="direction"):
        GlossLight(direction=(0.0, 0.0, 0.0))
