"""The comparison itself: each of its three parts, and the picture a failure leaves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.image_compare import EXACT, Tolerance, assert_close, problem_with, read_png

GREY = np.full((10, 10, 3), 100, np.uint8)


def changed(value: int) -> np.ndarray:
    image = GREY.copy()
    image[3, 4, 1] = value
    return image


def test_each_part_of_a_tolerance() -> None:
    assert problem_with(changed(103), GREY, Tolerance(3, 0.0, 3)) is None
    assert "1.00% of pixels beyond 3/255" in (problem_with(changed(104), GREY, Tolerance(3, 0.0, 9)) or "")
    assert problem_with(changed(104), GREY, Tolerance(3, 0.01, 9)) is None
    assert "up to 10/255" in (problem_with(changed(90), GREY, Tolerance(3, 0.01, 9)) or "")
    assert "shape" in (problem_with(GREY[:5], GREY, EXACT) or "")


def test_failure_writes_the_difference(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match=r"grey: .* see .*grey-diff\.png"):
        assert_close(changed(110), GREY, EXACT, tmp_path, "grey")
    written = read_png(tmp_path / "grey-diff.png")
    assert written.shape == (10, 30, 3)
    assert written[3, 24, 1] == 80
