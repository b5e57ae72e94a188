"""The lens of a picture larger than the views: a lattice of viewpoints about the eye."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.exports.large_lens import large_lens
from iibr_core.exports.source import ExportSource


@pytest.mark.parametrize("enlarged", [2.0, 5.0])
def test_the_points_of_a_disc_lie_evenly_about_its_middle(source: ExportSource, enlarged: float) -> None:
    lens = large_lens(replace(source.optics, aperture_diameter=2.5), source.scene, enlarged)
    places = np.array([sample.offset for sample in lens.samples])
    weights = np.array([sample.weight for sample in lens.samples])
    assert len(places) > 3
    assert weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(weights @ places, 0, atol=1e-9)
    assert np.hypot(*places.T).max() <= 2.5
