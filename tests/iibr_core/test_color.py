import numpy as np
import pytest

from iibr_core import color
from iibr_core.runtime import scalars


def test_round_trip_and_known_points():
    values = np.linspace(0, 4, 1001, dtype=np.float32)
    assert np.allclose(color.srgb_from_linear(color.linear_from_srgb(values)), values, atol=2e-6, rtol=1e-6)
    assert color.linear_from_srgb(np.float32([0, 1, 0.5])) == pytest.approx([0, 1, 0.2140411], abs=1e-6)


def test_kernels_agree_with_arrays():
    for value in (-1.0, 0.0, 0.01, 0.04045, 0.5, 1.0, 7.0):
        assert scalars.linear_scalar(value) == pytest.approx(float(color.linear_from_srgb(np.float32(value))), rel=1e-5)
        assert scalars.srgb_scalar(value) == pytest.approx(float(color.srgb_from_linear(np.float32(value))), rel=1e-5)


def test_storing_keeps_eight_bits_and_hdr():
    eight_bits = np.arange(256, dtype=np.uint8)
    assert (color.stored_from_encoded(color.encoded_from_stored(eight_bits), is_hdr=False) == eight_bits).all()
    assert list(color.bytes_from_encoded(np.float32([-1, 0.4 / 255, 0.6 / 255, 1, 7]))) == [0, 0, 1, 255, 255]
    bright = np.float32([0, 1, 12.5, 1e9])
    stored = color.stored_from_encoded(bright, is_hdr=True)
    assert stored.dtype == np.float16
    assert np.isfinite(stored).all()
    assert stored[2] == 12.5
