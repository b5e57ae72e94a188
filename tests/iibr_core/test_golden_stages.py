"""Results of the stages between map and views on a hard scene, as small pictures that each show a whole stage.

`pytest --regenerate-golden` writes them; then look at them.
"""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.inpainting.background import continues_in_front, fill_background
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.inpainting.disparity_holes import fill_disparity_holes
from iibr_core.inpainting.outpainting import outpaint
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.flying_pixels import without_flying_pixels
from iibr_core.method.look_up import look_up
from iibr_core.method.mixed_pixels import move_with_foreground, split_mixed_pixels
from iibr_core.method.rays import RaysBehind, rays_of_photo
from iibr_core.method.steep_surfaces import join_steep_rays
from iibr_core.stages import ALL_STAGES
from iibr_core.types import Margins, ViewOffset
from tests.iibr_core.golden_scene import assert_golden_pictures, grey, hard_scene, with_maps

OFFSET = ViewOffset(1.0, -2.0)


def side_by_side(*pictures):
    return np.concatenate(pictures, axis=1)


def holes():
    """Return filled holes: wide and thin ones, at the border, across surfaces; ordinary, and without texture.

    They cross the borders of blocks. Where nothing is known, nothing is written.
    """
    photo, disparity = hard_scene(size=(91, 125))
    hole = np.random.default_rng(3).random(disparity.shape) < 0.03
    hole[12:45, 36:49] = hole[54:, 57:99] = hole[:10, 75:] = hole[30:42, 105:] = hole[58:75, :13] = True
    pictures = []
    for hides, at, threads, stages in (
        (np.roll(disparity, (3, -4), (0, 1)), OFFSET, 2, ALL_STAGES),
        (np.full_like(disparity, -np.inf), ViewOffset(0.0, 0.0), 1, replace(ALL_STAGES, synthesise_patches=False)),
    ):
        colors, values = photo.copy(), disparity.copy()
        colors[hole] = values[hole] = 0
        fill_background(colors, values, hole, hides, at, threads, stages, farthest_views=None if any(at) else 3.0)
        nothing = np.zeros_like(photo), np.zeros_like(disparity)
        fill_background(*nothing, np.ones_like(hole), hides, at, stages=stages, farthest_views=1.0)
        assert not np.any(nothing[0])
        pictures.append(with_maps(colors, values, hole))
    in_front = continues_in_front(np.where(hole, np.float32(0.5), disparity), hole, np.roll(disparity, 5, 1), OFFSET)
    return [*pictures, grey(in_front, 0, 1)]


def mixed_pixels():
    pictures = []
    for is_hdr in (False, True):
        photo, disparity = hard_scene(is_hdr)
        own, fringe, nearer, coverage = split_mixed_pixels(photo, disparity, 0.5)
        fringe = np.where(coverage[..., None] > 0, fringe, 0) / (2 if is_hdr else 1)
        moved = np.where(np.isnan(nearer), move_with_foreground(disparity, (0.1, 3.2)), nearer)
        pictures += [side_by_side(own / (2 if is_hdr else 1), fringe), side_by_side(grey(moved), grey(coverage, 0, 1))]
    return pictures


def flying_pixels():
    """Return colours with pixels that stand out, without them where rays may be torn off: stored ones, and HDR."""
    photo, disparity = hard_scene()
    rays, random = rays_of_photo(photo, disparity, 2.0, 0, Margins(3, 0, 2, 4)), np.random.default_rng(1)
    odd, inpainted = random.random(disparity.shape) < 0.15, random.random(disparity.shape) < 0.2
    colors = np.where(odd[..., None], random.random(photo.shape), photo).astype(np.float32)
    stored = [stored_from_encoded(colors, is_hdr) for is_hdr in (False, True)]
    made = [
        without_flying_pixels(part, disparity, inpainted, rays.photo_detail, OFFSET, rays.margins, threads=2)
        for part in stored
    ]
    assert [part.dtype for part in made] == [part.dtype for part in stored]
    return [
        side_by_side(colors, encoded_from_stored(made[0])),
        side_by_side(*(made[1], grey(rays.photo_detail, 0, 1)[3:, 2:-4])),
    ]


def landings():
    """Return what lands on a view: sums of coverage, nearest and heaviest surfaces, joined rays, cells and colours."""
    photo, disparity = hard_scene()
    rays, pictures = rays_of_photo(photo, disparity, 2.5, 1), []
    filled = np.random.default_rng(2).random(disparity.shape) < 0.5
    pixel = np.flatnonzero(np.random.default_rng(3).random(disparity.shape) < 0.1)
    behind = RaysBehind(pixel, photo.reshape(-1, 3)[pixel], disparity.reshape(-1)[pixel] - 3)
    rays.add(ViewOffset(-2.0, 1.0), 1 - photo, disparity - 1, filled, behind)
    for offset in (ViewOffset(2.3, -1.7), ViewOffset(-0.4, 0.9)):
        found = find_candidates(rays, offset, (5, 61), (3, 80))
        weights, share = closed_form(found)
        shown = look_up(rays, found, weights)
        used = np.arange(5)[:, None, None] < found.number
        total = np.where(used, found.coverage, 0).sum(axis=0)
        pictures += [
            side_by_side(grey(total, 0, 3), grey(share * found.number, 0, 5)),
            side_by_side(grey(np.where(used, found.disparity, -9).max(axis=0)), grey(shown.disparity)),
            side_by_side(shown.colors, grey(shown.source, 0, 3)),
        ]
    joined = join_steep_rays(disparity, 0.2)
    return [*pictures, side_by_side(grey(joined, 0, 3), grey(rays.arrays.near_edge[0], 0, 1)),
            side_by_side(grey(rays.arrays.near_edge[2], 0, 1), grey(rays.arrays.coverage[2], 0, 1))]  # fmt: skip


def filled_maps():
    """Return maps whose unknown pixels are filled by colour and from the background, and a photo beyond its frame."""
    photo, disparity = hard_scene()
    given = np.where(np.random.default_rng(2).random(disparity.shape) < 0.2, np.float32(np.nan), disparity)
    given[10:33, 26:34] = given[44:, 20:30] = given[:9, 49:] = given[20:30, 60:66] = np.nan
    filled = fill_disparity_by_color(photo, given), fill_disparity_holes(given)
    colors, values = outpaint(photo, disparity, Margins(7, 10, 5, 12))
    return [side_by_side(*map(grey, filled)), side_by_side(colors, grey(values))]


PICTURES = [holes, mixed_pixels, flying_pixels, landings, filled_maps]


@pytest.mark.parametrize("made", PICTURES, ids=lambda made: made.__name__)
def test_pictures_are_the_golden_ones(made, tmp_path, regenerate_golden):
    assert_golden_pictures(made(), made.__name__.replace("_", "-"), tmp_path, regenerate_golden)
