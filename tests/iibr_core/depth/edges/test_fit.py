"""Sharpened maps whose edges are moved to fit the blur that they come from."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.edges.fit import _find_missing, fit_to_blur
from iibr_core.training.degradation import blur
from tests.iibr_core.depth.edges.test_refine import disc_before_slope

SIGMA, EDGE = 2.0, 0.12


def scene() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a photo, its exact disparity and one with an outline that is wrong by a pixel, here and there."""
    photo, exact, _ = disc_before_slope(120)
    rng, places = np.random.default_rng(5), np.mgrid[:120, :120]
    shifts = [np.rint(blur(rng.normal(size=(120, 120)).astype(np.float32), 1.0) * 4).clip(-1, 1) for _ in "yx"]
    y, x = (places + shifts).clip(0, 119).astype(int)
    return photo, exact, exact[y, x]


def wrong_side(fitted: np.ndarray, exact: np.ndarray) -> int:
    return int(np.count_nonzero((fitted > 1.2) != (exact > 1.2)))


def test_ragged_outlines_become_whole() -> None:
    photo, exact, start = scene()
    fitted = fit_to_blur(photo, blur(exact, SIGMA), start, SIGMA, EDGE)
    assert wrong_side(start, exact) > 80
    assert wrong_side(fitted, exact) < 0.1 * wrong_side(start, exact)


def test_the_missing_part_is_the_map_minus_the_blurred_one() -> None:
    _, _, exact = scene()
    taps = np.exp(-0.5 * (np.arange(-6, 7) / SIGMA) ** 2)
    taps = (taps / taps.sum()).astype(np.float32)
    missing = np.empty_like(exact)
    _find_missing(np.zeros_like(exact), exact, taps, 0, 120, missing)
    padded = np.pad(exact, 6, mode="edge")
    for y, x in ((0, 0), (50, 36), (119, 119)):
        assert -missing[y, x] == pytest.approx(taps @ padded[y : y + 13, x : x + 13] @ taps, abs=1e-5)
