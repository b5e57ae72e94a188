"""How much a hurried picture leaves out follows from what drawing was seen to take; no clock is read here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewer.gpu.refocus.frame_budget import (
    OVERHEAD_S,
    QUALITY_LEVELS,
    DrawCost,
    FrameTimeModel,
    QualityLevel,
    choose_quality_level,
    stretch_image,
)

PIXELS = 400_000
OF_LENS = DrawCost(samples=80, sources=0, has_reprojection=False, keeps_layers=True, pixels=PIXELS)


def work_in(level: QualityLevel) -> DrawCost:
    pixels = round(PIXELS * level.scale**2)
    return replace(OF_LENS, samples=max(80 // level.stride**2, 1), pixels=pixels)


def test_more_time_means_less_haste() -> None:
    frame_time = FrameTimeModel(5e-9)
    chosen = [choose_quality_level(work_in, frame_time, budget_s, 0) for budget_s in (1.0, 0.1, 0.05, 0.02, 0.001)]
    assert chosen == sorted(chosen)
    assert chosen[0] == 0
    assert chosen[-1] == len(QUALITY_LEVELS) - 1, "at the least, something is drawn"


def test_what_is_chosen_fits_the_time() -> None:
    frame_time = FrameTimeModel(5e-9)
    for budget_s in np.geomspace(0.01, 1, 20):
        chosen = choose_quality_level(work_in, frame_time, budget_s, 0)
        if chosen < len(QUALITY_LEVELS) - 1:
            assert frame_time.seconds(work_in(QUALITY_LEVELS[chosen])) <= budget_s
        assert all(frame_time.seconds(work_in(better)) > budget_s for better in QUALITY_LEVELS[:chosen])


def test_the_pace_is_learnt_for_each_sort_of_work() -> None:
    frame_time = FrameTimeModel(5e-9)
    pinhole = DrawCost(0, 4, False, False, PIXELS)
    guess = frame_time.seconds(pinhole)
    for _ in range(12):
        frame_time.learn(OF_LENS, 0.3)
    assert frame_time.seconds(OF_LENS) == pytest.approx(0.3, rel=0.01)
    assert frame_time.seconds(replace(OF_LENS, pixels=PIXELS // 4)) == pytest.approx(
        (0.3 - OVERHEAD_S) / 4 + OVERHEAD_S, 0.02
    )
    assert frame_time.seconds(pinhole) == guess


def test_cheap_frames_on_a_stored_view_tell_nothing_of_those_beside_it() -> None:
    """Else the first frame of a drag is drawn as if it took next to no time."""
    frame_time = FrameTimeModel(5e-9)
    at_rest = DrawCost(0, 1, False, False, PIXELS)
    before = frame_time.seconds(replace(at_rest, searches=True))
    for _ in range(12):
        frame_time.learn(at_rest, 0.004)
    assert frame_time.seconds(at_rest) < before / 3
    assert frame_time.seconds(replace(at_rest, searches=True)) == before


def test_what_was_not_drawn_yet_is_not_thought_quicker_than_what_was() -> None:
    frame_time = FrameTimeModel(5e-9)
    frame_time.learn(OF_LENS, 3.0)
    per_fetch = (3.0 - OVERHEAD_S) / OF_LENS.fetches
    pinhole = DrawCost(0, 4, False, False, PIXELS)
    assert frame_time.seconds(pinhole) == pytest.approx(OVERHEAD_S + per_fetch * pinhole.fetches)


def test_a_picture_near_the_limit_does_not_change_back_and_forth() -> None:
    frame_time = FrameTimeModel(5e-9)
    budget_s = frame_time.seconds(work_in(QUALITY_LEVELS[3])) * 1.02
    worse = choose_quality_level(work_in, frame_time, budget_s / 1.05, 0)
    assert worse > 3
    assert choose_quality_level(work_in, frame_time, budget_s, worse) == worse, "barely enough time: it stays"
    assert choose_quality_level(work_in, frame_time, 1.3 * budget_s, worse) <= 3, "time to spare: it becomes better"


@given(
    width=st.integers(1, 9),
    height=st.integers(1, 9),
    to=st.tuples(st.integers(1, 30), st.integers(1, 30)),
    seed=st.integers(0, 99),
)
def test_stretched_against_plain_interpolation(width: int, height: int, to: tuple[int, int], seed: int) -> None:
    image = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)

    def along(values: np.ndarray, length: int) -> np.ndarray:
        at = (np.arange(length) + 0.5) * len(values) / length - 0.5
        columns = [np.interp(at, np.arange(len(values)), column) for column in values.reshape(len(values), -1).T]
        return np.stack(columns, -1).reshape(length, *values.shape[1:])

    expected = along(along(image.astype(float), to[1]).swapaxes(0, 1), to[0]).swapaxes(0, 1)
    assert stretch_image(image, to).shape == (to[1], to[0], 3)
    assert np.abs(stretch_image(image, to) - expected).max() <= 0.51
    np.testing.assert_array_equal(stretch_image(image, to, 3), stretch_image(image, to)[::3, ::3])
