"""The bucket's surface: its pieces against scipy's, and what bounds it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from iibr_core.depth.editing.bucket import surface_at
from iibr_core.depth.editing.edits import Stroke

HEIGHT, WIDTH = 60, 80


def photo_of(color: float = 0.4) -> np.ndarray:
    return np.full((HEIGHT, WIDTH, 3), color, np.float32)


def filled(
    photo: np.ndarray, disparity: np.ndarray | None = None, x: float = 0.1, y: float = 0.5, radius: float = 0.03
):
    disparity = np.zeros(photo.shape[:2], np.float32) if disparity is None else disparity
    return surface_at(photo, disparity, Stroke("fill", ((x, y),), radius, 1.0), 0, (0.0, 1.0))


def test_an_edge_of_the_photo_or_of_the_map_ends_it() -> None:
    photo, left = photo_of(), np.zeros((HEIGHT, WIDTH), bool)
    left[:, :50] = True
    photo[~left] = 0.8
    np.testing.assert_array_equal(filled(photo), left)
    np.testing.assert_array_equal(filled(photo, x=0.9), ~left)
    np.testing.assert_array_equal(filled(photo_of(), np.where(left, 0, 0.5).astype(np.float32)), left)
    soft = ndimage.gaussian_filter(photo, (0, 1, 0))
    assert (filled(soft) ^ filled(soft, x=0.9)).all(), "a blurred edge belongs half to each side"


def test_soft_shades_are_one_until_they_turn_into_another_colour() -> None:
    shade = np.linspace(0.1, 0.9, WIDTH, dtype=np.float32)
    photo = np.broadcast_to(shade[:, None], (HEIGHT, WIDTH, 3))
    assert filled(0.3 + photo / 4, np.tile(shade, (HEIGHT, 1))).all()
    mask = filled(photo.copy())
    assert mask[:, :10].all()
    assert not mask[:, WIDTH // 2 :].any()


def test_it_does_not_run_out_through_a_gap() -> None:
    photo = photo_of()
    photo[:, 38:42] = 0.9
    photo[30:33, 38:42] = 0.4
    mask = filled(photo)
    assert mask[:, :34].all(), "its mouth is as near to edges as the gap itself"
    assert not mask[:, 42:].any()


def test_texture_under_the_brush_is_no_edge() -> None:
    photo = photo_of(0.3)
    photo[:, ::2] = 0.6
    photo[:, 60:] = [0.1, 0.9, 0.1]
    assert filled(photo, radius=0.1)[:, :58].all()
    assert not filled(photo, radius=0.1)[:, 60:].any()


def test_holes_smaller_than_the_brush_are_filled_and_larger_ones_are_not() -> None:
    photo = photo_of()
    photo[10:13, 40:43] = 0.9
    photo[30:45, 40:60] = 0.9
    mask = filled(photo)
    assert mask[:25].all()
    assert not mask[32:43, 42:58].any()


@pytest.mark.parametrize("place", [(0.5, 0.5), (0.51, 0.1)])
def test_thin_surfaces_and_clicks_on_edges_give_something(place: tuple[float, float]) -> None:
    photo = photo_of()
    photo[:, 40:43] = 0.9
    assert filled(photo, x=place[0], y=place[1]).any()


@pytest.mark.parametrize("place", [(-0.1, 0.5), (0.5, 1.0), (1e30, 0.5)])
def test_outside_the_photo_there_is_none(place: tuple[float, float]) -> None:
    assert not filled(photo_of(), x=place[0], y=place[1]).any()


@pytest.mark.parametrize(("tolerance", "columns"), [(0.25, 20), (1.0, 50), (4.0, 80)])
def test_tolerance_is_the_contrast_that_ends_the_surface(tolerance: float, columns: int) -> None:
    photo = photo_of()
    photo[:, 20:] += 0.06
    photo[:, 50:] += 0.2
    stroke = Stroke("fill", ((0.1, 0.5),), 0.02, 1.0, tolerance=tolerance)
    mask = surface_at(photo, np.zeros((HEIGHT, WIDTH), np.float32), stroke, 0, (0.0, 1.0))
    assert mask[:, : columns - 2].all()
    assert not mask[:, columns + 2 :].any()
