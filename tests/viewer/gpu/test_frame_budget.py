"""How much a hurried picture leaves out follows from what drawing was seen to take; no clock is read here."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iibr_core.beyond.picture_quality import QUALITY_LEVELS, QualityLevel
from viewer.gpu.refocus.frame_budget import OVERHEAD_S, DrawCost, FrameTimeModel, choose_quality_level

PIXELS = 400_000
LENS = DrawCost(samples=12, warps=True, pixels=PIXELS)
BLEND = DrawCost(samples=4, warps=False, pixels=PIXELS)


def work_in(level: QualityLevel) -> DrawCost:
    pixels = round(PIXELS * level.scale**2)
    return replace(LENS, samples=round(12 * level.cameras), pixels=pixels)


def test_more_time_means_less_haste() -> None:
    frame_time = FrameTimeModel(5e-9)
    chosen = [choose_quality_level(work_in, frame_time, budget_s, 0) for budget_s in (1.0, 0.1, 0.05, 0.02, 0.001)]
    assert chosen == sorted(chosen)
    assert chosen[0] == 0
    assert chosen[-1] == len(QUALITY_LEVELS) - 1, "at the least, something is drawn"


def test_the_pace_is_learnt_for_each_sort_of_work() -> None:
    frame_time = FrameTimeModel(5e-9)
    guess = frame_time.seconds(BLEND)
    for _ in range(12):
        frame_time.learn(LENS, 0.1)
    assert frame_time.seconds(LENS) == pytest.approx(0.1, rel=0.01)
    assert frame_time.seconds(replace(LENS, pixels=PIXELS // 4)) == pytest.approx(
        (0.1 - OVERHEAD_S) / 4 + OVERHEAD_S, 0.02
    )
    assert frame_time.seconds(BLEND) == guess


def test_a_picture_near_the_limit_does_not_change_back_and_forth() -> None:
    frame_time = FrameTimeModel(5e-9)
    budget_s = frame_time.seconds(work_in(QUALITY_LEVELS[3])) * 1.02
    worse = choose_quality_level(work_in, frame_time, budget_s / 1.05, 0)
    assert worse > 3
    assert choose_quality_level(work_in, frame_time, budget_s, worse) == worse, "barely enough time: it stays"
    assert choose_quality_level(work_in, frame_time, 1.3 * budget_s, worse) <= 3, "time to spare: it becomes better"
