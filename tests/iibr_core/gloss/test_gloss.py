from dataclasses import replace
from math import cos, radians, sin

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb
from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.microfacet import reflected_share
from iibr_core.gloss.normals import fit_normals
from iibr_core.gloss.settings import Gloss, GlossLight, GlossSurface
from iibr_core.gloss.shading import make_gloss_maps, shade, shade_views
from iibr_core.types import GridShape, ViewOffset, ViewUpdate

SIZE = 60, 80
GEOMETRY = SceneGeometry(focal_px=90.0, infinity=-1.5)


def rays(size=SIZE, geometry=GEOMETRY):
    y, x = np.mgrid[: size[0], : size[1]].astype(np.float64)
    return np.stack(
        [(x - (size[1] - 1) / 2) / geometry.focal_px, (y - (size[0] - 1) / 2) / geometry.focal_px, np.ones(size)], -1
    )


def disparity_of(depth, geometry=GEOMETRY):
    return (geometry.focal_px / depth + geometry.infinity).astype(np.float32)


def sphere(centre=(0, 0, 40.0), radius=12.0, behind=60.0):
    """(disparity, normals, hit) of a sphere before a wall."""
    direction, centre = rays(), np.array(centre)
    a, b, c = (direction**2).sum(-1), direction @ centre, centre @ centre - radius**2
    root = b * b - a * c
    hit = root > 0
    depth = np.where(hit, (b - np.sqrt(np.maximum(root, 0))) / a, behind)
    normals = np.where(hit[..., None], (direction * depth[..., None] - centre) / radius, [0, 0, -1.0])
    return disparity_of(depth), normals.astype(np.float32), hit


def plane(normal=(0.3, -0.4, -1.0), distance=40.0):
    """(disparity, normal) of a plane through (0, 0, distance)."""
    normal = np.array(normal) / np.linalg.norm(normal)
    depth = distance * normal[2] / (rays() @ normal)
    return disparity_of(depth), normal.astype(np.float32)


UP = np.array([0.0, 0.0, 1.0])


def direction(polar_deg, azimuth_deg=0.0):
    polar, azimuth = radians(polar_deg), radians(azimuth_deg)
    return np.array([sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar)])


def share(gloss, n, v, light):
    return reflected_share(tuple(n), tuple(v), tuple(light), gloss.lobe)


def test_a_mirror_shows_the_light_itself_and_nothing_beside_it():
    mirror = Gloss(roughness=0.0, reflectance=1.0, light=GlossLight(radius_deg=2.0))
    v = direction(30)
    assert share(mirror, UP, v, direction(30, 180)) == pytest.approx(1.0, rel=0.01)
    assert share(mirror, UP, v, direction(45, 180)) < 0.01


@pytest.mark.parametrize(
    ("v", "light"), [((30, 0), (91, 180)), ((91, 0), (30, 180)), ((120, 0), (120, 180)), ((0, 0), (180, 0))]
)
def test_light_or_eye_behind_the_surface_gives_nothing(v, light):
    assert share(Gloss(), UP, direction(*v), direction(*light)) == 0


def degrees_apart(a, b):
    return np.degrees(np.arccos(np.clip((a * b).sum(-1), -1, 1)))


def test_normals_of_a_plane_are_exact_up_to_the_border():
    disparity, normal = plane()
    assert degrees_apart(fit_normals(disparity, GEOMETRY), normal).max() < 0.2


def test_normals_of_a_sphere_come_close_and_the_wall_behind_it_stays_flat():
    disparity, normals, hit = sphere()
    apart = degrees_apart(fit_normals(disparity, GEOMETRY), normals)
    assert np.median(apart[hit]) < 1
    assert np.percentile(apart[hit], 90) < 5
    assert np.percentile(apart[~hit], 99) < 1
    step = (disparity.max() - disparity.min()) / 255
    apart = degrees_apart(fit_normals(np.round(disparity / step) * step, GEOMETRY), normals)
    assert np.median(apart[hit]) < 4, "also of a map in steps"


def test_rounding_from_pixel_to_pixel_does_not_show_in_the_normals_of_a_large_map():
    """Taps of large maps lie apart; a map that alternates must not have normals that do."""
    y, x = np.mgrid[:300, :700]
    rounded = (5 + 0.004 * x + 0.02 * ((x + y) % 2)).astype(np.float32)
    normals = fit_normals(rounded, SceneGeometry(600.0, 0.0))[40:-40, 40:-40]
    assert np.abs(np.diff(normals[..., 0], axis=1)).max() < 0.01


GREY = np.full((*SIZE, 3), 0.4, np.float32)
GLOSS = Gloss(roughness=0.35, light=GlossLight((-0.3, -0.3, -1)))


def maps_of(gloss, disparity, geometry=GEOMETRY, normals=None, photo=GREY):
    return make_gloss_maps(gloss.surface, photo, disparity, geometry, normals)


def shaded(gloss, maps, offset, disparity=None, photo=GREY):
    colors = photo.copy()
    shade(colors, maps.disparity if disparity is None else disparity, ViewOffset(*offset), gloss, maps)
    return colors


def test_on_a_plane_the_highlight_of_a_far_light_stays_in_the_frame_of_what_is_far():
    """Its virtual image is infinitely far: it moves by the disparity of infinity, not by the surface's."""
    disparity, _ = plane((0, 0, -1))
    gloss = replace(GLOSS, light=GlossLight((0.05, 0, -1)))
    maps = maps_of(gloss, disparity)
    places = [shaded(gloss, maps, (0, s)).sum(-1).argmax() % SIZE[1] for s in (-2, 0, 2)]
    assert places[0] - places[1] == pytest.approx(2 * GEOMETRY.infinity, abs=1)
    assert places[1] - places[2] == pytest.approx(2 * GEOMETRY.infinity, abs=1)


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


@pytest.mark.parametrize("is_marked", [True, False])
def test_views_keep_their_kind_and_those_without_disparity_or_surface_stay(is_marked):
    flat = np.full(SIZE, 0.75, np.float32)
    given = [ViewUpdate(1, 1, (GREY * 255).astype(np.uint8), flat), ViewUpdate(1, 0, GREY.astype(np.float16), None)]
    gloss = replace(GLOSS, surface=GlossSurface(strokes_only=not is_marked))
    first, second = shade_views(iter(given), gloss, maps_of(gloss, flat), GridShape(3, 3).offset)
    assert second is given[1]
    if is_marked:
        assert first.colors.dtype == np.uint8
        assert first.colors.max() > given[0].colors.max()
    else:
        assert first is given[0]


def test_a_smaller_light_of_the_same_strength_is_brighter_and_needs_a_direction():
    wide = GlossLight((0.0, -3.0, -4.0), radius_deg=4.0)
    assert wide.unit_direction == pytest.approx((0, -0.6, -0.8))
    assert replace(wide, radius_deg=2.0).radiance[0] == pytest.approx(4 * wide.radiance[0], rel=0.01)
    with pytest.raises(ValueError, match="direction"):
        GlossLight(direction=(0.0, 0.0, 0.0))
