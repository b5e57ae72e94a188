"""Edge bands of depth edges: every pixel on one of the two sides, by its colour."""

import numpy as np
import pytest
from iibr_core.depth.edges.edge_band import _find_between, resolve_edge_band

from iibr_core.runtime import tiling
from iibr_core.runtime.work import Cancelled, stoppable
from tests.iibr_core.scenes import smooth_texture, square_before_wall

RED, BLUE = np.float32([0.8, 0.1, 0.1]), np.float32([0.1, 0.2, 0.8])
NEAR, FAR, EDGE = 9.0, 2.0, 0.3


def disc(size=64):
    """A red disc before a blue wall, slightly noisy, and its disparity."""
    y, x = np.mgrid[:size, :size]
    inside = (x - size / 2) ** 2 + (y - size / 2) ** 2 < (size / 4) ** 2
    photo = np.where(inside[..., None], RED, BLUE) + np.random.default_rng(5).normal(0, 0.01, (size, size, 3))
    return photo.astype(np.float32), np.where(inside, NEAR, FAR).astype(np.float32)


def resolve(photo, values, unknown=None):
    unknown = np.zeros(values.shape, np.bool_) if unknown is None else unknown
    return resolve_edge_band(photo, values, EDGE, unknown)


def resampled(truth):
    """The map, half a pixel beside the photo: in between at its edges, as resampled maps are."""
    return 0.5 * (truth + np.roll(truth, 1, axis=1))


def test_what_lies_between_two_surfaces_goes_to_the_one_it_looks_like():
    photo, truth = disc()
    given = resampled(truth)
    resolved = resolve(photo, given)
    assert (np.abs(given - truth) > 1).sum() > 50
    assert (np.abs(resolved - truth) > 1).sum() == 0


def test_what_lies_between_is_not_passed_on_by_mixed_pixels_which_look_like_it():
    """A wire between mixed columns, in which the map knows every third pixel only."""
    photo, truth = np.full((60, 40, 3), BLUE), np.full((60, 40), FAR, np.float32)
    photo[:, 20:22], truth[:, 20:22], photo[:, [19, 22]] = RED, NEAR, 0.5 * RED + 0.5 * BLUE
    photo[:, :8], truth[:, :8] = RED, NEAR
    given, unknown = resampled(truth), np.zeros(truth.shape, np.bool_)
    given[:, 19:24] = 4.0, NEAR, NEAR, 6.0, FAR
    unknown[:, [19, 22]] = (np.arange(60) % 3 > 0)[:, None]
    assert set(np.unique(resolve(photo, given, unknown)[:, 10:])) == {FAR, NEAR}


def test_edge_bands_that_look_like_the_other_side_change_it():
    photo, truth = disc()
    given = resampled(np.roll(truth, 1, axis=0))
    wrong, left = (np.abs(values - truth) > 1 for values in (given, resolve(photo, given)))
    assert left.sum() < 0.1 * wrong.sum()


def test_where_colours_do_not_tell_the_sides_apart_nothing_changes_sides():
    _, truth = disc()
    given = resampled(truth)
    resolved = resolve(np.full((*truth.shape, 3), 0.5, np.float32), given)
    is_surface = np.isin(given, [NEAR, FAR])
    np.testing.assert_array_equal(resolved[is_surface], given[is_surface])


def test_a_measured_map_beside_the_photo_is_moved_to_it():
    photo, truth = disc()
    given, unknown = np.roll(truth, 1, axis=1), np.zeros(truth.shape, np.bool_)
    unknown[14:18, 28:36] = True
    given[unknown] = FAR
    wrong, left = (np.abs(values - truth) > 1 for values in (given, resolve(photo, given, unknown)))
    assert wrong.sum() > 50
    assert left.sum() < 0.2 * wrong.sum()


def test_no_pixel_changes_sides_alone():
    photo, truth = disc()
    given = resampled(truth)
    photo[32, 10] = RED
    assert resolve(photo, given)[32, 10] == FAR


@pytest.mark.parametrize("height", [8.2, 5.0])
def test_a_lone_pixel_between_two_surfaces_is_none_of_them_but_a_thing_is_one(height):
    """Before a wall and behind what is nearer: such a thing may be thin, and ends somewhere."""
    values = np.full((40, 40), FAR, np.float32)
    values[:, 21:] = NEAR
    values[10, 20] = height
    assert np.argwhere(_find_between(values, EDGE)[0]).tolist() == [[10, 20]]
    values[11, 20:22] = values[12, 19:22] = values[13:, 19:22] = height
    found, clear = _find_between(values, EDGE)
    assert not found.any()
    assert (clear > 0) == (height == 5.0)


def test_beside_the_border_nothing_is_clearly_between():
    """There is no room for a plateau, and the other side of the map is none."""
    values = np.full((40, 40), FAR, np.float32)
    values[:, :6], values[:, -1], values[10, -2] = NEAR, NEAR, 5.0
    for turn in range(4):
        found, clear = _find_between(np.ascontiguousarray(np.rot90(values, turn)), EDGE)
        assert (found.sum(), clear) == (1, 0)


def test_exact_maps_stay_as_they_are():
    photo, truth = disc()
    np.testing.assert_array_equal(resolve(photo, truth), truth)
    scene, disparity = square_before_wall()
    np.testing.assert_array_equal(resolve(scene.pixels, disparity.values), disparity.values)


def test_a_turned_scene_is_settled_alike():
    photo, truth = disc()
    given = resampled(truth)
    upright = resolve(photo, given)
    turned = resolve(photo.swapaxes(0, 1), np.ascontiguousarray(given.T)).T
    np.testing.assert_allclose(turned, upright, atol=1e-4)


def test_results_do_not_depend_on_the_number_of_threads(monkeypatch):
    photo, truth = disc()
    expected = resolve(photo, resampled(truth))
    monkeypatch.setattr(tiling, "THREADS", 7)
    np.testing.assert_array_equal(resolve(photo, resampled(truth)), expected)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (3, 2), (8, 8)])
def test_tiny_maps(size):
    values = np.arange(size[0] * size[1], dtype=np.float32).reshape(size)
    assert np.isfinite(resolve(smooth_texture(*size), values)).all()


def test_a_stop_is_heard():
    photo, truth = disc()
    with pytest.raises(Cancelled), stoppable(lambda: True):
        resolve(photo, resampled(truth))
