"""Discs of an open lens: reduction and enlargement blur them no further."""

import numpy as np
import pytest

from iibr_core.beyond.lens_slices import MAX_SLICES, disc_taps, slices_of
from iibr_core.beyond.optics import ApertureShape


@pytest.mark.parametrize("diameter_px", [-13.0, 20.0, 100.0, 400.0])
def test_a_reduced_disc_is_as_wide_as_asked_for(diameter_px):
    """The variance of a disc along an axis is a sixteenth of its squared diameter."""
    (reduced,) = slices_of(np.array([diameter_px]), ApertureShape())
    x, _, weights = reduced.taps.T
    texel, fraction = 2.0**reduced.level, x - np.floor(x)
    bilinear = weights @ (x**2 + fraction * (1 - fraction))
    reduction, enlargement = 1 / 12, 1 / 6
    assert texel > 1
    assert weights.sum() == pytest.approx(1.0)
    variance_px = texel**2 * (bilinear + reduction + enlargement)
    assert variance_px == pytest.approx(diameter_px**2 / 16, rel=0.02)


def test_a_disc_at_full_size_has_no_negative_weights():
    assert disc_taps(ApertureShape("polygon", blades=5), 9.0, False)[:, 2].min() > 0


def test_however_much_is_blurred_there_are_few_slices():
    slices = [each.diameter_px for each in slices_of(np.linspace(-900, 800, 5000), ApertureShape())]
    assert 16 < len(slices) <= MAX_SLICES
    assert slices == sorted(slices, reverse=True)
    assert 0.0 in slices
