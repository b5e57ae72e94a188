"""Sharpened maps whose edges are moved to fit the blur that they come from."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.edges.fit import _find_missing, fit_to_blur
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.training.degradation import blur
from tests.iibr_core.scenes import smooth_texture

SIZE = (96, 128)
SIGMA, EDGE = 2.0, 0.12


def disc() -> tuple[np.ndarray, np.ndarray]:
    """Return a photo and the exact disparity of a disc before a slanted wall, textured alike."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    is_disc = np.hypot(x - 60, y - 45) < 24
    photo = np.where(is_disc[..., None], smooth_texture(*SIZE, 3) * [1, 0.7, 0.5], smooth_texture(*SIZE, 4) * 0.6)
    return photo.astype(np.float32), np.where(is_disc, 2.0, 0.2 + 0.002 * x).astype(np.float32)


def ragged(exact: np.ndarray) -> np.ndarray:
    """Return the map with an outline that is wrong by a pixel, here and there."""
    rng = np.random.default_rng(5)
    dy, dx = (np.rint(blur(rng.normal(size=SIZE).astype(np.float32), 1.0) * 4).clip(-1, 1).astype(int) for _ in "yx")
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    is_disc = exact[np.clip(y + dy, 0, SIZE[0] - 1), np.clip(x + dx, 0, SIZE[1] - 1)] > 1.2
    return np.where(is_disc, 2.0, 0.2 + 0.002 * x).astype(np.float32)


def wrong_side(fitted: np.ndarray, exact: np.ndarray) -> int:
    return int(np.count_nonzero((fitted > 1.2) != (exact > 1.2)))


def test_ragged_outlines_become_whole() -> None:
    photo, exact = disc()
    start = ragged(exact)
    fitted = fit_to_blur(photo, blur(exact, SIGMA), start, SIGMA, EDGE)
    assert wrong_side(start, exact) > 80
    assert wrong_side(fitted, exact) < 0.1 * wrong_side(start, exact)


def test_pixels_that_were_not_sharpened_stay_if_nothing_moves_beside_them() -> None:
    photo, exact = disc()
    soft, start = blur(exact, SIGMA), ragged(exact)
    soft[:, :60] = start[:, :60]
    fitted = fit_to_blur(photo, soft, start, SIGMA, EDGE)
    np.testing.assert_array_equal(fitted[:, :48], start[:, :48])
    assert not np.array_equal(fitted[:, 66:], start[:, 66:])


def test_the_missing_part_is_the_map_minus_the_blurred_one() -> None:
    exact = ragged(disc()[1])
    taps = np.exp(-0.5 * (np.arange(-6, 7) / SIGMA) ** 2)
    taps = (taps / taps.sum()).astype(np.float32)
    missing = np.empty_like(exact)
    _find_missing(np.zeros_like(exact), exact, taps, 0, SIZE[0], missing)
    padded = np.pad(exact, 6, mode="edge")
    for y, x in ((0, 0), (50, 36), (95, 127)):
        assert -missing[y, x] == pytest.approx(taps @ padded[y : y + 13, x : x + 13] @ taps, abs=1e-5)


def test_fitting_can_be_cancelled() -> None:
    photo, exact = disc()
    answers = iter([False] * 3)
    with pytest.raises(Cancelled), stoppable(lambda: next(answers, True)):
        fit_to_blur(photo, blur(exact, SIGMA), ragged(exact), SIGMA, EDGE)
