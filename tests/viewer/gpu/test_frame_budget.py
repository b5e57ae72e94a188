"""How much a hurried picture leaves out follows from what drawing was seen to take; no clock is read here."""

import pytest

from iibr_core.beyond.picture_quality import QUALITY_LEVELS
from viewer.gpu.refocus.frame_budget import OVERHEAD_S, FrameTimeModel, choose_quality_level, fetches_of

PIXELS = 400_000


def work_in(level):
    return fetches_of(3 * level.sources, round(PIXELS * level.scale**2), warps=True)


def test_the_pace_is_learnt():
    frame_time, fetches = FrameTimeModel(5e-9), fetches_of(12, PIXELS, warps=True)
    for _ in range(12):
        frame_time.learn(fetches, 0.1)
    assert frame_time.seconds(fetches) == pytest.approx(0.1, rel=0.01)
    assert frame_time.seconds(fetches / 4) == pytest.approx((0.1 - OVERHEAD_S) / 4 + OVERHEAD_S, 0.02)


def test_a_picture_near_the_limit_does_not_change_back_and_forth():
    frame_time = FrameTimeModel(5e-9)
    budget_s = frame_time.seconds(work_in(QUALITY_LEVELS[3])) * 1.02
    worse = choose_quality_level(work_in, frame_time, budget_s / 1.05, 0)
    assert worse > 3
    assert choose_quality_level(work_in, frame_time, budget_s, worse) == worse, "barely enough time: it stays"
    assert choose_quality_level(work_in, frame_time, 1.3 * budget_s, worse) <= 3, "time to spare: it becomes better"
