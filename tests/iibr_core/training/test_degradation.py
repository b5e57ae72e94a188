import numpy as np
import pytest

from iibr_core.training.degradation import blur, coarsen, degrade, misalign


def rough(shape=(31, 37), seed=0):
    return np.random.default_rng(seed).normal(0, 2, shape).astype(np.float32)


@pytest.mark.parametrize("sigma", [0.5, 1.3, 4.0])
def test_blur_against_the_sum_over_all_pixels(sigma):
    d = rough((6, 9))
    far = np.pad(d, 40, mode="edge").astype(np.float64)
    y, x = np.indices(far.shape)
    for i, j in [(0, 0), (3, 4), (5, 8)]:
        weights = np.exp(-0.5 * ((y - i - 40) ** 2 + (x - j - 40) ** 2) / sigma**2)
        assert blur(d, sigma)[i, j] == pytest.approx((weights * far).sum() / weights.sum(), abs=5e-3)
    assert (blur(d, 0.0) == d).all()


def test_coarse_averages_squares_and_keeps_slopes():
    y, x = np.mgrid[0:24, 0:30].astype(np.float32)
    slope = 0.3 * x - 0.2 * y
    assert coarsen(slope, 4)[2:-2, 2:-4] == pytest.approx(slope[2:-2, 2:-4], abs=1e-4)
    d = rough((9, 12))
    assert coarsen(d, 3)[4, 7] == pytest.approx(d[3:6, 6:9].mean(), abs=1e-5)


def test_misalignment_moves_down_and_right():
    d = rough()
    assert misalign(d, 2.0, 3.0)[2:, 3:] == pytest.approx(d[:-2, :-3], abs=1e-4)
    assert misalign(d, 0.0, -0.25)[:, :-1] == pytest.approx(0.75 * d[:, :-1] + 0.25 * d[:, 1:], abs=1e-4)


def test_degrade_repeats_by_seed_and_leaves_its_input_alone():
    d = rough()
    before = d.copy()
    for seed in range(30):
        out, again = (degrade(d, np.random.default_rng(seed), 4.0) for _ in range(2))
        assert out.shape == d.shape
        assert out.dtype == np.float32
        assert np.isfinite(out).all()
        assert (out == again).all()
    assert (d == before).all()
