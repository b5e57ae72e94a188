from itertools import product

import numpy as np
import pytest

import iibr_core as iibr
from iibr_core.beyond.between_views import densify, require_steps
from iibr_core.color import bytes_from_encoded, encoded_from_stored
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.method import memory
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset, ViewUpdate
from tests.iibr_core.known_scenes import write_grid
from tests.iibr_core.scenes import by_index, disparity_of, generate, literal_plan, photo_of, smooth_texture

SPARSE, DENSE = GridShape(3, 3), GridShape(5, 5)
SIZE = ImageSize(72, 90)


def drawn_views(grid, scene):
    """Return colours and disparity (px per step of DENSE) of all views of a grid over the same viewpoints as DENSE."""
    step = (DENSE.rows - 1) / (grid.rows - 1)
    views = {}
    for at in np.ndindex(*grid):
        colors, disparity = render(scene, SIZE, ViewOffset(*(step * part for part in grid.offset(*at))), samples=2)
        views[at] = bytes_from_encoded(colors), disparity
    return views


def flat_view(row, column, grey, disparity=0.0, size=(12, 16)):
    return ViewUpdate(row, column, np.full((*size, 3), grey, np.uint8), np.full(size, disparity, np.float32))


def test_views_between_are_better_than_from_the_centre_alone_and_given_ones_come_back():
    scene = random_scene(np.random.default_rng(11), SIZE, 2.0)
    sparse, dense = drawn_views(SPARSE, scene), drawn_views(DENSE, scene)
    given = [ViewUpdate(*at, colors, 2 * disparity) for at, (colors, disparity) in sparse.items()]
    made = by_index(list(densify(given, SPARSE, DENSE)))
    assert set(made) == set(dense)
    assert all((made[2 * row, 2 * column].colors == colors).all() for (row, column), (colors, _) in sparse.items())
    photo, disparity = photo_of(encoded_from_stored(sparse[1, 1][0])), disparity_of(sparse[1, 1][1])
    alone = by_index(list(generate(photo, disparity, literal_plan(photo, disparity, 5))))
    new = [at for at in dense if at[0] % 2 or at[1] % 2]
    ours, theirs = ([bounded_psnr(views[at].colors, dense[at][0]) for at in new] for views in (made, alone))
    assert np.mean(ours) > np.mean(theirs) + 3
    assert np.mean([np.abs(made[at].disparity - dense[at][1]) > 0.25 for at in new]) < 0.05


def test_what_no_given_view_shows_is_inpainted_once_and_shared():
    # A panel before a wall, with a slit through which every view sees another part of the wall.
    wall = bytes_from_encoded(smooth_texture(40, 64))
    given = []
    for column in (0, 1):
        disparity, colors = np.zeros((40, 64), np.float32), wall.copy()
        slit = slice(34 - 10 * column, 38 - 10 * column)
        disparity[8:32], colors[8:32] = 10.0, (200, 30, 30)
        disparity[:, slit], colors[:, slit] = 0.0, wall[:, slit]
        given.append(ViewUpdate(0, column, colors, disparity))
    views = by_index(list(densify(given, GridShape(1, 2), GridShape(1, 6))))
    completing, beside = views[0, 2], views[0, 3]
    # The slit stands at 30 .. 33 and 28 .. 31: both see the wall at 30 and 31.
    shared = np.s_[12:28, 30:32]
    assert completing.inpainted[shared].all()
    assert beside.inpainted[shared].all()
    assert np.abs(completing.colors[shared].astype(int) - beside.colors[shared]).max() <= 1
    assert np.abs(completing.disparity[shared]).max() < 0.1
    assert np.abs(completing.colors[shared].astype(int) - (200, 30, 30)).max(axis=-1).min() > 40


def test_views_that_contradict_each_other_stay_between_and_pass_over_smoothly():
    given = [flat_view(0, 0, 20), flat_view(0, 1, 220)]
    views = by_index(list(densify(given, GridShape(1, 2), GridShape(1, 9))))
    greys = [views[0, column].colors for column in range(9)]
    assert all(np.ptp(grey) == 0 for grey in greys)
    levels = [int(grey[0, 0, 0]) for grey in greys]
    assert levels == sorted(levels)
    assert levels[0] == 20
    assert levels[-1] == 220
    assert max(np.diff(levels)) < 35


@pytest.mark.parametrize(("sparse", "dense"), [((3, 3), (5, 5)), ((2, 2), (4, 4)), ((2, 3), (3, 5))])
def test_the_centre_comes_first_given_or_not_and_every_view_once(sparse, dense):
    sparse, dense = GridShape(*sparse), GridShape(*dense)
    # Maps of noise: all views that complete the rays have something to add.
    grey = np.full((12, 16, 3), 90, np.uint8)
    noise = np.random.default_rng(0)
    given = [ViewUpdate(*at, grey, noise.uniform(-9, 9, (12, 16)).astype(np.float32)) for at in np.ndindex(sparse)]
    places = [(view.row, view.column) for view in densify(given, sparse, dense)]
    assert places[0] == dense.centre
    assert sorted(places) == list(np.ndindex(dense))


@pytest.mark.parametrize(
    ("sparse", "dense", "advice"),
    [((3, 3), (8, 8), "5x5, 7x7, 9x9"), ((3, 3), (3, 3), "5x5"), ((3, 3), (2, 2), "5x5"), ((3, 3), (9, 5), "9x9"),
     ((1, 3), (9, 9), "1x5"), ((1, 1), (9, 9), "the picture itself")],
)  # fmt: skip
def test_grids_that_do_not_fit_are_refused_with_those_that_do(sparse, dense, advice):
    with pytest.raises(InputError, match=advice):
        require_steps(GridShape(*sparse), GridShape(*dense))


def test_fields_that_lack_views_or_room_get_none_between(tmp_path, monkeypatch):
    star = write_grid(tmp_path / "star")
    for v, u in product((0, 2), repeat=2):
        (star / "views" / f"v{v:02d}_u{u:02d}.png").unlink()
    with pytest.raises(InputError, match=r"star.*: only 5 of 9 views are there; get the others"):
        iibr.open(star).light_field((5, 5))
    whole, said = iibr.open(write_grid(tmp_path / "whole")), []
    whole.light_field((5, 5), report_progress=lambda *progress: said.append(progress))
    assert [each for each in said if each[2] == "reading views"] == [(n, 9, "reading views") for n in range(1, 10)]
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * 40 * 48 * 9 * 60 - 2)
    with pytest.raises(InputError, match=r"making views between 3x3 of whole \(48x40\) takes 1 MiB"):
        whole.light_field((5, 5))
