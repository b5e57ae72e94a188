"""The plain warp that fields are timed against lands what the reference does, its slow twin."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.peers import warp
from iibr_core.evaluation.reference_warp import NOWHERE, reference_warp
from iibr_core.types import ViewOffset
from tests.iibr_core.scenes import square_before_wall


@pytest.mark.parametrize("offset", [ViewOffset(0.0, 1.0), ViewOffset(-1.3, 0.4), ViewOffset(2.0, -2.0)])
def test_the_plain_warp_lands_what_the_reference_does(offset: ViewOffset) -> None:
    photo, wall = square_before_wall(40, 60, 3.0)
    slope = (wall.values + 0.02 * np.arange(60)).astype(np.float32)
    nearest, expected = warp._land(slope, offset.t, offset.s), reference_warp(photo.pixels, slope, offset)
    assert ((nearest == NOWHERE) <= expected.hole).all()
    np.testing.assert_allclose(nearest[~expected.hole], expected.disparity[~expected.hole], atol=1e-4)
    assert 0 < expected.hole.mean() < 0.5
