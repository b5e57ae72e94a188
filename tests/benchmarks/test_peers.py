"""What stands beside ours moves planes as geometry says, and hides what lies behind."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.peers import warp
from benchmarks.peers.__main__ import PEERS
from iibr_core.evaluation.warp import NOWHERE, reference_warp
from iibr_core.training.degradation import blur
from iibr_core.types import FloatImage, ViewOffset
from tests.iibr_core.scenes import square_before_wall

WAYS = pytest.mark.parametrize("name", PEERS)


def _photo() -> FloatImage:
    noise = np.random.default_rng(3).random((3, 40, 56)).astype(np.float32)
    return np.clip(0.5 + 2 * (np.stack([blur(one, 1.5) for one in noise], axis=-1) - 0.5), 0, 1)


@WAYS
def test_a_plane_moves_by_its_disparity(name: str) -> None:
    photo = _photo()
    view = PEERS[name](photo, np.full(photo.shape[:2], 2.0, np.float32))(ViewOffset(-1.0, 1.5))
    np.testing.assert_allclose(view[3:-1, 1:-5], photo[1:-3, 4:-2], atol=0.02)


@WAYS
def test_the_foreground_hides_the_background(name: str) -> None:
    photo, disparity = np.zeros((40, 56, 3), np.float32), np.zeros((40, 56), np.float32)
    photo[10:30, 20:30], disparity[10:30, 20:30] = 1.0, 4.0
    view = PEERS[name](photo, disparity)(ViewOffset(0.0, 2.0))
    assert view[13:27, 15:19].min() > 0.95, "the square, moved to the left by 8 px"
    assert view[13:27, :9].max() < 0.05
    assert view[:6].max() < 0.05


@pytest.mark.parametrize("offset", [ViewOffset(0.0, 1.0), ViewOffset(-1.3, 0.4), ViewOffset(2.0, -2.0)])
def test_the_plain_warp_lands_what_the_reference_does(offset: ViewOffset) -> None:
    """Its slow twin."""
    photo, wall = square_before_wall(40, 60, 3.0)
    slope = (wall.values + 0.02 * np.arange(60)).astype(np.float32)
    nearest, expected = warp._land(slope, offset.t, offset.s), reference_warp(photo.pixels, slope, offset)
    assert ((nearest == NOWHERE) <= expected.hole).all()
    np.testing.assert_allclose(nearest[~expected.hole], expected.disparity[~expected.hole], atol=1e-4)
    assert 0 < expected.hole.mean() < 0.5
