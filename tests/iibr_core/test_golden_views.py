"""Views of hard scenes as small pictures: of grids, between given views, of free cameras, and what they are made of.

`pytest --regenerate-golden` writes them; then look at them.
"""

from dataclasses import replace
from functools import cache, partial
from math import cos, radians, sin

import numpy as np
import pytest

import iibr_core as iibr
from iibr_core.beyond.between_views import densify
from iibr_core.beyond.free_cameras import FreeViews, fitted_cameras, inverse_depth_of, steered
from iibr_core.beyond.full_size import LargePhoto, Part, tiles_of, views_of_tile
from iibr_core.beyond.hidden_surfaces import SeenBehind, hidden_surface
from iibr_core.color import convert
from iibr_core.method.light_field import ViewMaker
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.view import Renderer
from iibr_core.stages import ALL_STAGES
from iibr_core.training.degradation import degrade
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import DISPLAY_P3, SRGB, Camera, GridShape, ImageSize, ViewOffset, ViewUpdate
from tests.iibr_core.golden_scene import (
    GRID,
    HEIGHT,
    WIDTH,
    assert_golden_pictures,
    grey,
    hard_field,
    hard_scene,
    with_maps,
)

CORNERS = [ViewOffset(-2.0, -2.0), ViewOffset(1.0, 2.0)]


@cache
def maker(*left_out):
    return ViewMaker(*hard_scene(), CORNERS, stages=replace(ALL_STAGES, **dict.fromkeys(left_out, False)))


def without(*stages):
    return [made(maker(*stages).view(at)) for at in (ViewOffset(1.0, 1.7), ViewOffset(-2.0, -2.0))]


def made(view):
    return with_maps(view.colors, view.disparity, view.inpainted)


def stored(whole, *places):
    return [with_maps(whole.views[at], whole.disparity[at], whole.inpainted[at]) for at in places]


def between_stored_views():
    return [*(hard_field().view(*at) for at in ((1.3, -0.6), (-1.75, 0.9))), hard_field(True).view(0.5, 0.5) / 2]


def for_viewing():
    """Return views of a photo in other primaries whose map counts the other way round and has wild pixels."""
    photo, disparity = hard_scene(size=(91, 125))
    given = 40 - 10 * disparity
    given[30, 60:63] = 1e5
    scene = iibr.from_arrays(convert(photo, SRGB, DISPLAY_P3), given)
    return stored(scene.light_field((2, 3), depth_strength=-3.0), (0, 0), (1, 2), (0, 1))


def far_outside():
    views = ViewMaker(*hard_scene(), [ViewOffset(0.3, -0.2)])
    return [made(views.view(at)) for at in (ViewOffset(-1.6, 2.3), ViewOffset(0.25, -0.1))]


def what_is_known():
    offset, rays = ViewOffset(-1.4, 1.1), maker().rays
    view, covered = Renderer(shipped_transformer()).visible(rays, offset, threads=2)
    return [grey(view_entropy(rays, offset), 0, 1), grey(covered, 0, 1.5), grey(view.inpainted, 0, 1)]


def between_given_views():
    """Return HDR views of three steps for one of a grid whose rows stand closer."""
    whole, dense = hard_field(True), GridShape(4, 4)
    given = [
        ViewUpdate(v, u, whole.views[3 * v, 3 * u], 3 * whole.disparity[3 * v, 3 * u]) for v, u in np.ndindex(2, 2)
    ]
    views = {(view.row, view.column): view for view in densify(given, GridShape(2, 2), dense, row_step=0.8)}
    return [made(views[at]) for at in ((1, 1), (2, 3), (0, 2))]


def turned(yaw_deg, pitch_deg, roll_deg):
    turn = np.eye(3)
    for axis, degrees in ((1, yaw_deg), (0, pitch_deg), (2, roll_deg)):
        (i, j), about = ((axis + 1) % 3, (axis + 2) % 3), np.eye(3)
        about[i, i] = about[j, j] = cos(radians(degrees))
        about[j, i], about[i, j] = sin(radians(degrees)), -sin(radians(degrees))
        turn = turn @ about
    return turn


def of_free_cameras(is_hdr=False, **options):
    """Return views of a photo off its camera's axis: moved, turned, from farther, through a longer lens, steered."""
    photo, disparity = hard_scene(is_hdr)
    axes, place = turned(10, -20, 5), np.array([1.0, -2.0, 0.5])
    taken = Camera(axes, place, ImageSize(2 * HEIGHT, 2 * WIDTH), (180.0, 170.0), (90.0, 50.0), "photo")
    moved = replace(taken, position=place + axes @ (0.25, -0.15, 0.1), focal_px=(150.0, 160.0))
    aside = replace(taken, world_from_camera=axes @ turned(-6, 4, 12), position=place + axes @ (-0.2, 0.1, -0.3))
    near = replace(moved, size=ImageSize(80, 120), focal_px=(200.0, 220.0), centre_px=(40.0, 35.0))
    taken, *cameras = fitted_cameras([taken, moved, aside, near], 0, ImageSize(HEIGHT, WIDTH))
    cameras.append(steered(taken, 0.3, -0.4, 0.35))
    views = FreeViews(photo, inverse_depth_of(disparity, (2.0, 9.0)), taken, cameras, **options)
    seen = map(views.view, cameras)
    return [with_maps(view.colors, 13 * view.disparity / views.scale_px, view.inpainted) for view in seen]


def tiles_of_a_large_photo():
    """Return views of a photo half as large again as its field, which it borrows hidden surfaces from, tile by tile."""
    photo, disparity = hard_scene(size=(91, 125))
    large, part, pictures = LargePhoto(photo, disparity, maker().rays), Part(-3, 88, 2, 127), []
    for offset in (ViewOffset(-2.0, 1.3), ViewOffset(0.8, -2.0)):
        halves = np.zeros((part.size.height, 2, part.size.width, 3))
        for tile in tiles_of(part, 50):
            (view,) = views_of_tile(large, tile, [offset], Renderer())
            rows, columns = tile.inside(part).slices
            both = with_maps(view.colors, view.disparity / 1.5, view.inpainted)
            halves[rows, :, columns] = both.reshape(tile.size.height, 2, tile.size.width, 3)
        pictures.append(halves.reshape(part.size.height, -1, 3))
    return pictures


def behind_the_photo():
    photo, disparity = hard_scene()
    whole = hard_field()
    seen = [SeenBehind(GRID.offset(*at), whole.views[at], whole.disparity[at], whole.inpainted[at])
            for at in ((0, 0), (3, 4))]  # fmt: skip
    surfaces = hidden_surface(photo, disparity, 2.6, seen), hidden_surface(photo, disparity, 0.9)
    return [with_maps(each.colors, each.disparity, ~each.mask) for each in surfaces]


def scenes_for_training():
    size, pictures = ImageSize(48, 64), []
    for seed, offset in ((3, ViewOffset(-1.5, 2.0)), (12, ViewOffset(3.0, 0.4)), (29, ViewOffset(0.0, -2.5))):
        colors, disparity = render(random_scene(np.random.default_rng(seed), size, 4.0), size, offset)
        maps = [degrade(disparity, np.random.default_rng(10 * seed + k), 4.0) for k in range(7)]
        pictures.append(np.concatenate([colors, *(grey(each, -4, 6) for each in (disparity, *maps))], axis=1))
    return pictures


PICTURES = {
    "views": lambda: stored(hard_field(), (0, 0), (3, 4), (1, 4), (3, 1)),
    "views-hdr": lambda: stored(hard_field(True), (0, 4), (3, 0)),
    "views-between": between_stored_views,
    "views-for-viewing": for_viewing,
    "views-far-outside": far_outside,
    "views-known": what_is_known,
    "views-by-closed-form": partial(without, "ray_transformer", "remove_flying_pixels"),
    "views-plainly": partial(without, "outpainted_lines", "connect_slopes", "synthesise_patches"),
    "views-alone": partial(without, "share_inpainted", "split_mixed_pixels", "outpainting"),
    "between-given-views": between_given_views,
    "free-cameras": of_free_cameras,
    "free-cameras-hdr": partial(of_free_cameras, True, inpainter=None),
    "tiles": tiles_of_a_large_photo,
    "behind-the-photo": behind_the_photo,
    "scenes-for-training": scenes_for_training,
}  # fmt: skip


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_the_golden_ones(name, tmp_path, regenerate_golden):
    assert_golden_pictures(PICTURES[name](), name, tmp_path, regenerate_golden)
