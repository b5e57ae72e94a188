from dataclasses import replace

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.rendering.gloss.geometry import SceneGeometry
from iibr_core.rendering.gloss.gloss_settings import Gloss, GlossLight, GlossSurface
from iibr_core.rendering.gloss.microfacet import reflected_share
from iibr_core.rendering.gloss.shading import make_gloss_maps, shade, shade_views
from iibr_core.types import (
    GridShape,
    InputError,
    ViewOffset,
    ViewUpdate,
)
from tests.iibr_core.rendering.gloss.scenes import GEOMETRY, SIZE, plane, sphere

GREY = np.full((*SIZE, 3), 0.4, np.float32)
GLOSS = Gloss(roughness=0.35, light=GlossLight((-0.3, -0.3, -1)))
DARK = GlossLight(color=(0, 0, 0))


def shaded(maps, offset, disparity=None, photo=GREY):
    colors = photo.copy()
    shade(colors, maps.disparity if disparity is None else disparity, ViewOffset(*offset), maps)
    return colors


def plainly_shaded(maps, offset, photo):
    """The same of a flat map, whose disparity is known at every place: pixel by pixel, by the docstrings' formulas."""
    height, width = maps.mask.shape
    result = linear_from_srgb(photo)
    light, focal = maps.gloss.light.unit_direction, maps.geometry.focal_px
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
        share = reflected_share(*map(float, (*normal, *eye, *light)), *maps.gloss.lobe_widths, maps.gloss.reflectance)
        for c in range(3):
            result[y, x, c] += share * (maps.gloss.light.radiance[c] - result[y, x, c])
    return srgb_from_linear(result)


@pytest.mark.parametrize("offset", [(0, 0), (1, -2)])
def test_it_is_the_lobe_at_every_pixel(offset):
    flat = np.full(SIZE, 0.75, np.float32)
    maps = make_gloss_maps(GLOSS, GREY, flat, GEOMETRY)
    inner = slice(4, -4), slice(4, -4)
    assert np.allclose(shaded(maps, offset)[inner], plainly_shaded(maps, offset, GREY)[inner], atol=1e-4)


def brightest(colors):
    return np.unravel_index(colors.sum(-1).argmax(), colors.shape[:2])


def test_on_a_plane_the_highlight_of_a_far_light_stays_in_the_frame_of_what_is_far():
    """Its virtual image is infinitely far: it moves by the disparity of infinity, not by the surface's."""
    disparity, _ = plane((0, 0, -1))
    maps = make_gloss_maps(replace(GLOSS, light=GlossLight((0.05, 0, -1))), GREY, disparity, GEOMETRY)
    places = [brightest(shaded(maps, (0, s)))[1] for s in (-2, 0, 2)]
    assert places[0] - places[1] == pytest.approx(2 * GEOMETRY.infinity, abs=1)
    assert places[1] - places[2] == pytest.approx(2 * GEOMETRY.infinity, abs=1)


def test_colours_stay_between_the_matt_ones_and_the_light():
    disparity, _, _ = sphere()
    gloss = replace(GLOSS, reflectance=1.0, light=GlossLight((0, 0, -1), (0.001, 0.002, 0.004)))
    maps = make_gloss_maps(gloss, GREY, disparity, GEOMETRY)
    linear, white = linear_from_srgb(shaded(maps, (0, 1))), np.array(gloss.light.radiance)
    matt = linear_from_srgb(GREY[0, 0])
    assert (linear >= np.minimum(matt, white) - 1e-4).all()
    assert (linear <= np.maximum(matt, white) + 1e-4).all()


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0.2, 1)])
def test_light_from_behind_changes_nothing(direction):
    disparity, _, _ = sphere()
    maps = make_gloss_maps(replace(GLOSS, light=GlossLight(direction)), GREY, disparity, GEOMETRY)
    facing = maps.normals[..., 2] < -0.5
    assert np.allclose(shaded(maps, (0, 0))[facing], GREY[facing], atol=1e-6)


@pytest.mark.parametrize("roughness", [0.0, 1.0])
@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (6, 7)])
@pytest.mark.parametrize("shines", [False, True])
def test_mirrors_and_dull_surfaces_of_any_size_are_finite(roughness, shape, shines):
    photo = np.random.default_rng(0).uniform(0, 1, (*shape, 3)).astype(np.float32)
    disparity = np.random.default_rng(1).uniform(-1, 3, shape).astype(np.float32)
    environment = np.ones((4, 8, 3), np.float32)
    for light in (GlossLight(), DARK):
        gloss = Gloss(roughness=roughness, light=light, photo_shines=shines)
        maps = make_gloss_maps(gloss, photo, disparity, SceneGeometry(8.0, 0.0), environment)
        assert np.isfinite(shaded(maps, (1.5, -100.0), photo=photo)).all()


@pytest.mark.parametrize("roughness", [0.0, 0.2, 1.0])
def test_a_plane_seen_edge_on_shows_no_more_than_light_and_surroundings_have(roughness):
    """Grazing, everything is a mirror: what is reflected comes in the paint's place, never beside it."""
    grazing = 1.45
    disparity, normal = plane((0, -np.sin(grazing), -np.cos(grazing)))
    towards = np.array([0, -np.sin(0.2), np.cos(0.2)])
    gloss = Gloss(roughness=roughness, light=GlossLight(tuple(towards), (0.002, 0.002, 0.002), radius_deg=3.0))
    around = np.full((8, 16, 3), 0.6, np.float32)
    normals = np.broadcast_to(normal, (*SIZE, 3)).copy()
    maps = make_gloss_maps(gloss, GREY, disparity, GEOMETRY, around, normals)
    light = linear_from_srgb(shaded(maps, (0, 1)))
    assert light.min() >= linear_from_srgb(GREY).min() - 1e-4
    assert light.max() <= max(0.6, *gloss.light.radiance) + 1e-3
    assert light.max() > 0.3


def test_without_parallax_nothing_depends_on_the_viewpoint():
    flat = np.zeros(SIZE, np.float32)
    maps = make_gloss_maps(GLOSS, GREY, flat, SceneGeometry(90.0, 0.0))
    assert np.allclose(shaded(maps, (0, 0)), shaded(maps, (3, 4)), atol=1e-4)


def test_what_shows_beside_a_surface_in_other_views_gets_none_of_its_gloss():
    disparity, _, hit = sphere()
    gloss = replace(GLOSS, surface=GlossSurface(farthest=0.1), reflectance=1.0)
    maps = make_gloss_maps(gloss, GREY, disparity, GEOMETRY)
    wall = np.full(SIZE, disparity[~hit].max(), np.float32)
    assert np.array_equal(shaded(maps, (0, 3), disparity=wall), GREY)


def test_surroundings_are_seen_where_mirrors_show_them():
    """The upper half of the surroundings is bright: a mirror that faces up shows it, one that faces down does not."""
    environment = np.zeros((16, 32, 3), np.float32)
    environment[:8] = 0.9
    gloss = Gloss(roughness=0.0, reflectance=1.0, light=DARK)
    for tilt, light in ((-1.0, 0.9), (1.0, 0.0)):
        disparity, _ = plane((0, tilt, -1))
        maps = make_gloss_maps(gloss, GREY, disparity, GEOMETRY, environment)
        assert linear_from_srgb(shaded(maps, (0, 0)))[SIZE[0] // 2, SIZE[1] // 2, 0] == pytest.approx(light, abs=0.01)


def test_the_middle_of_the_surroundings_is_where_the_camera_looks():
    environment = np.zeros((64, 128, 3), np.float32)
    environment[28:36, 60:68] = 0.7
    gloss = Gloss(roughness=0.0, reflectance=1.0, light=DARK)
    # a mirror seen edge-on, nearly, sends the view on
    normal = np.broadcast_to(np.array([0, -np.cos(0.02), -np.sin(0.02)], np.float32), (*SIZE, 3))
    flat = np.full(SIZE, 0.5, np.float32)
    maps = make_gloss_maps(gloss, GREY, flat, GEOMETRY, environment, normals=normal)
    assert linear_from_srgb(shaded(maps, (0, 0)))[SIZE[0] // 2 + 2, SIZE[1] // 2, 0] == pytest.approx(0.7, abs=0.05)


def test_a_shining_photo_stays_as_it_is_and_its_highlight_runs_over_the_surface():
    disparity, _ = plane((0, 0, -1))
    matt = make_gloss_maps(GLOSS, GREY, disparity, GEOMETRY)
    photo = shaded(matt, (0, 0))
    maps = make_gloss_maps(replace(GLOSS, photo_shines=True), photo, disparity, GEOMETRY)
    assert np.abs(shaded(maps, (0, 0), photo=photo) - photo).max() < 0.03
    d = float(disparity[0, 0])
    carried = np.roll(photo, -round(2 * d), axis=1)  # the view two steps to the right, were it all paint
    true, inner = shaded(matt, (0, 2)), (slice(5, -5), slice(10, -10))
    assert np.abs(shaded(maps, (0, 2), photo=carried) - true)[inner].mean() < 0.3 * np.abs(carried - true)[inner].mean()


def updates():
    yield ViewUpdate(1, 1, (GREY * 255).astype(np.uint8), np.full(SIZE, 0.75, np.float32))
    yield ViewUpdate(1, 0, GREY.astype(np.float16), None)


def test_views_keep_their_kind_and_those_without_disparity_stay():
    maps = make_gloss_maps(GLOSS, GREY, np.full(SIZE, 0.75, np.float32), GEOMETRY)
    given = list(updates())
    first, second = shade_views(iter(given), maps, GridShape(3, 3))
    assert first.colors.dtype == np.uint8
    assert first.colors.max() > given[0].colors.max()
    assert second is given[1]


def test_with_nothing_marked_every_view_is_handed_on_untouched():
    nothing = replace(GLOSS, surface=GlossSurface(strokes_only=True))
    maps = make_gloss_maps(nothing, GREY, np.full(SIZE, 0.75, np.float32), GEOMETRY)
    given = list(updates())
    assert all(made is view for made, view in zip(shade_views(iter(given), maps, GridShape(3, 3)), given))


def test_a_gloss_that_is_not_sound_is_refused():
    with pytest.raises(InputError, match="roughness"):
        make_gloss_maps(Gloss(roughness=2.0), GREY, np.zeros(SIZE, np.float32), GEOMETRY)


def test_surroundings_grow_brighter_towards_grazing_angles_as_schlick_has_it():
    """In the middle of the picture, at 75 degrees: R + (1 - R) (1 - cos)^5 of them."""
    angle = np.radians(75)
    normal = np.broadcast_to(np.array([0, -np.sin(angle), -np.cos(angle)], np.float32), (*SIZE, 3))
    gloss = Gloss(roughness=0.0, reflectance=0.04, light=DARK)
    around = np.full((16, 32, 3), 0.9, np.float32)
    maps = make_gloss_maps(gloss, GREY, np.full(SIZE, 0.5, np.float32), GEOMETRY, around, normals=normal)
    matt, share = linear_from_srgb(GREY[0, 0, 0]), 0.04 + 0.96 * (1 - np.cos(angle)) ** 5
    seen = linear_from_srgb(shaded(maps, (0, 0)))[SIZE[0] // 2 - 1 : SIZE[0] // 2 + 1, SIZE[1] // 2, 0].mean()
    assert seen == pytest.approx(matt + share * (0.9 - matt), abs=3e-3)
