"""Refocused pictures as evaluation compares them: sums of sheared views, and a path-traced thin lens."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.color import encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.evaluation.metrics import psnr
from iibr_core.evaluation.refocus import FocalStack, Focus, foci_of
from iibr_core.method.light_field import generate
from iibr_core.types import ViewOffset
from tests.iibr_core.known_scenes import WALL, disparity_of_square, offsets_of
from tests.iibr_core.lens_scenes import GRID, NAMES, lens_scene
from tests.iibr_core.scenes import literal_plan, smooth_texture

MADE_DB = {"shelf": 42.0, "fence": 38.5}
"""Lowest PSNR of a refocused field against the lens; the photo as it is has 30.4 and 24.3."""


def refocused(views: dict[ViewOffset, np.ndarray], focus: Focus) -> np.ndarray:
    stack = FocalStack([focus], views[ViewOffset(0.0, 0.0)])
    for offset, view in views.items():
        if offset != (0, 0):
            stack.add(offset, view)
    (picture,) = stack.pictures().values()
    return picture


def inner(picture: np.ndarray, focus: Focus) -> np.ndarray:
    margin = focus.margin_px
    return picture[margin:-margin, margin:-margin]


@pytest.mark.parametrize("disparity", [0.0, 0.37, -1.6, 2.0])
def test_sums_against_a_slow_twin(disparity: float) -> None:
    views = {at: smooth_texture(40, 48, k) for k, at in enumerate(offsets_of(3, 3).values())}
    focus = Focus("x", disparity, 1.0)
    y, x = np.mgrid[0:40, 0:48].astype(float)
    total, weights = np.zeros((40, 48, 3)), sum(focus.weight(at) for at in views)
    for at, view in views.items():
        places = [y - disparity * at.t, x - disparity * at.s]
        light = [map_coordinates(linear_from_srgb(view)[..., c], places, order=3) for c in range(3)]
        total += focus.weight(at) / weights * np.stack(light, axis=-1)
    expected = inner(srgb_from_linear(total.astype(np.float32)), focus)
    assert psnr(refocused(views, focus), expected) > (45 if disparity % 1 else 95)


def test_foci_lie_where_the_scene_does() -> None:
    near, middle, far = foci_of(list(offsets_of(5, 5).values())[1:], disparity_of_square())
    assert (near.name, near.disparity, near.radius) == ("near", 2.0, 2.0)
    assert (middle.name, middle.disparity) == ("middle", WALL)
    assert (far.name, far.disparity) == ("far", WALL)


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 9), (9, 1), (2, 2), (2, 9)])
def test_few_views_and_one_pixel_are_no_lens(rows: int, columns: int) -> None:
    offsets = [at for at in offsets_of(rows, columns).values() if at != (0, 0)]
    assert foci_of(offsets, disparity_of_square()) == []
    assert foci_of([ViewOffset(t, s) for t in (-4.0, 4.0) for s in (-4.0, 4.0)], disparity_of_square()) == []
    assert foci_of([at for at in offsets_of(3, 3).values() if at != (0, 0)], np.zeros((1, 1), np.float32)) == []


@pytest.mark.parametrize("name", NAMES)
def test_a_made_field_refocuses_as_the_lens_does(name: str) -> None:
    scene = lens_scene(name)
    focus = Focus("lens", scene.lens.focus_disparity, scene.lens.radius_views)
    lens = inner(scene.lens.picture, focus)
    true = {GRID.offset(*index): view for index, view in scene.views.items()}
    updates = generate(scene.photo, scene.disparity, literal_plan(scene.photo, scene.disparity, *GRID))
    made = {GRID.offset(update.row, update.column): encoded_from_stored(update.colors) for update in updates}
    assert MADE_DB[name] < psnr(refocused(made, focus), lens) < psnr(refocused(true, focus), lens)
    turned = Focus("lens", -scene.lens.focus_disparity, scene.lens.radius_views)
    assert psnr(refocused(true, turned), lens) < MADE_DB[name] - 5
