"""Ways that stand beside ours move planes as geometry demands, and hide what lies behind."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.scenes import MAPS, Scene, drawn_scene, offsets_of, plane_map, with_map
from benchmarks.ways import WAYS, land
from iibr_core.evaluation.warp import reference_warp
from iibr_core.training.degradation import blur
from iibr_core.types import FloatImage, GridShape, ImageSize, ViewOffset
from tests.iibr_core.scenes import square_before_wall

OTHERS = pytest.mark.parametrize("name", [name for name in WAYS if not name.startswith(("iibr", "unchanged"))])


def scene_of(photo: FloatImage, disparity: FloatImage) -> Scene:
    return Scene("scene", photo, disparity, {}, offsets_of(GridShape(5, 5)))


@OTHERS
def test_a_plane_moves_by_its_disparity(name: str) -> None:
    noise = np.random.default_rng(3).random((3, 40, 56)).astype(np.float32)
    photo = np.clip(0.5 + 2 * (np.stack([blur(channel, 1.5) for channel in noise], axis=-1) - 0.5), 0, 1)
    view = WAYS[name](scene_of(photo, np.full(photo.shape[:2], 2.0, np.float32)))(ViewOffset(-1.0, 1.5))
    np.testing.assert_allclose(view[3:-1, 1:-5], photo[1:-3, 4:-2], atol=0.02)


@OTHERS
def test_the_foreground_hides_the_background(name: str) -> None:
    photo, disparity = np.zeros((40, 56, 3), np.float32), np.zeros((40, 56), np.float32)
    photo[10:30, 20:30], disparity[10:30, 20:30] = 1.0, 4.0
    view = WAYS[name](scene_of(photo, disparity))(ViewOffset(0.0, 2.0))
    assert view[13:27, 15:19].min() > 0.95, "the square, moved to the left by 8 px"
    assert view[13:27, :9].max() < 0.05
    assert view[:6].max() < 0.05


@pytest.mark.parametrize("offset", [ViewOffset(0.0, 1.0), ViewOffset(-1.3, 0.4), ViewOffset(2.0, -2.0)])
def test_the_plain_warp_lands_what_the_reference_does(offset: ViewOffset) -> None:
    """Compare with its slow twin."""
    photo, wall = square_before_wall(40, 60, 3.0)
    slope = (wall.values + 0.02 * np.arange(60)).astype(np.float32)
    (nearest, hole), expected = land(slope, offset), reference_warp(photo.pixels, slope, offset)
    np.testing.assert_array_equal(hole, expected.hole)
    np.testing.assert_allclose(nearest[~hole], expected.disparity[~hole], atol=1e-4)
    assert 0 < hole.mean() < 0.5


@pytest.mark.parametrize("kind", [kind for kind in MAPS if kind != "exact"])
def test_worse_maps_are_worse_and_finite(kind: str) -> None:
    exact = drawn_scene(3, ImageSize(60, 320), 2.0, [(0, 1)])
    given = with_map(exact, kind, None)
    assert given.disparity.shape == exact.disparity.shape
    assert given.disparity.dtype == np.float32
    assert np.isfinite(given.disparity).all()
    assert (given.disparity != exact.disparity).any()


def test_one_plane_lies_where_the_views_want_it() -> None:
    photo = np.random.default_rng(0).random((40, 60, 3)).astype(np.float32)
    disparity = np.linspace(0, 4, 60, dtype=np.float32) * np.ones((40, 1), np.float32)
    moved = np.roll(photo, -2, axis=1)
    scene = Scene("a", photo, disparity, {ViewOffset(0.0, 1.0): moved}, offsets_of(GridShape(3, 3)))
    np.testing.assert_allclose(plane_map(scene).disparity, 2.0, atol=0.1)
