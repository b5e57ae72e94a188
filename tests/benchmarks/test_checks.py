"""What holds however a field is made: the checks find what they are to find, on fields where it is known."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from benchmarks.speed import checks
from benchmarks.speed.checks import band_pixels, field_bytes, invariance_targets, view_agreement
from benchmarks.speed.inputs import MADE_UP_REACH, made_up_scenes
from benchmarks.speed.prediction import BenchInput, whole_field
from benchmarks.speed.processes import output_lines, require_yardsticks
from iibr_core.evaluation.metrics import psnr
from iibr_core.runtime import tiling
from iibr_core.types import Disparity, GridShape, InputError, Photo, ViewOffset
from tests.iibr_core.known_scenes import disparity_of_square, view_of_square


@pytest.fixture(scope="module")
def square() -> BenchInput:
    photo = Photo(view_of_square(ViewOffset(0.0, 0.0)), 48.0, "square")
    return BenchInput("square", photo, Disparity(disparity_of_square(), "known"), GridShape(3, 3))


def test_a_field_is_the_same_in_any_order_and_in_any_bands(square: BenchInput) -> None:
    order, bands = invariance_targets(square)
    assert (order.is_met, bands.is_met) == (True, True)
    assert order.measured == "identical"
    assert len(field_bytes(square, ViewOffset(0.0, 0.0))) == 9


def test_a_field_that_differs_is_found(square: BenchInput, monkeypatch: pytest.MonkeyPatch) -> None:
    fields: Iterator[dict[tuple[int, int], bytes]] = iter([{(0, 0): b"a"}, {(0, 0): b"a"}, {(0, 0): b"b"}])
    monkeypatch.setattr(checks, "field_bytes", lambda *_: next(fields))
    assert [target.is_met for target in invariance_targets(square)] == [True, False]


def test_bands_are_as_before_when_the_block_ends() -> None:
    before = tiling.MOST_BAND_PIXELS
    with band_pixels(7):
        assert tiling.MOST_BAND_PIXELS == 7
    assert before == tiling.MOST_BAND_PIXELS


def test_views_of_one_field_agree(square: BenchInput) -> None:
    found = view_agreement(square)
    assert found.surface_rms < 5
    assert found.line_off_px < 0.1


def test_the_made_up_scene_has_true_views_of_every_quarter() -> None:
    own, soft = made_up_scenes(with_soft=True)
    assert (own.is_soft, soft.is_soft) == (False, True)
    assert own.reach == MADE_UP_REACH
    assert len(own.truth) == 12
    assert {(t, s) for t in (-4.0, 4.0) for s in (-4.0, 4.0)} <= own.truth.keys()
    assert {(np.sign(at.t), np.sign(at.s)) for at in own.truth} == {(-1, -1), (-1, 1), (1, -1), (1, 1)}
    assert own.truth.keys() <= set(own.field)
    assert max(np.abs(own.disparity).max(), 0.1) <= 2.0
    assert not any(psnr(view, own.photo) > 60 for view in own.truth.values())
    assert whole_field(own).grid == (9, 9)
    (alone,) = made_up_scenes(with_soft=False)
    np.testing.assert_array_equal(alone.photo, own.photo)


def test_a_program_that_fails_says_so_in_the_last_line() -> None:
    assert output_lines(["-c", "print(1); print(2)"]) == ("1", "2")
    assert output_lines(["-c", "print(1); raise SystemExit('no display')"]) == ("1", "failed: no display")


def test_yardsticks_need_scenes_and_scripts(tmp_path: Path) -> None:
    folder = tmp_path
    require_yardsticks(None, None)
    with pytest.raises(InputError, match="--data"):
        require_yardsticks(folder, None)
    with pytest.raises(InputError, match=r"judge_views\.py"):
        require_yardsticks(folder, folder)
