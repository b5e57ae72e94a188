"""The time that a job still takes."""

from __future__ import annotations

import pytest

from iibr_core.runtime.time_left import TimeLeft, about_left


class Clock:
    """A clock that a test sets."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_equal_steps_are_predicted_once_the_pace_is_known() -> None:
    clock = Clock()
    left = TimeLeft(clock)
    found = []
    for done in range(1, 6):
        clock.now += 5.0 if done == 1 else 2.0  # the first compiles kernels
        found.append(left.update(done, 10))
    assert found == [None, 16.0, 14.0, 12.0, 10.0]
    assert left.share == 0.5


def test_it_counts_down_between_steps_and_never_below_zero() -> None:
    clock = Clock()
    left = TimeLeft(clock)
    for done in (1, 2):
        clock.now += 2.0
        left.update(done, 4)
    clock.now += 1.0
    assert left.update(2, 4) == 3.0
    clock.now += 60.0
    assert left.update(2, 4) == 0.0


def test_the_share_only_grows_where_there_is_more_to_do() -> None:
    left = TimeLeft(Clock())
    left.update(5, 10)
    left.update(6, 20)
    assert left.share == 0.5
    left.update(20, 20)
    assert left.share == 1.0


def test_unknown_work_gives_no_prediction() -> None:
    assert TimeLeft(Clock()).update(0, 0) is None


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "about 1 s left"), (8.4, "about 8 s left"), (42, "about 40 s left"), (185, "about 3 min left"),
     (7200, "about 2.0 h left")],
)  # fmt: skip
def test_words(seconds: float, words: str) -> None:
    assert about_left(seconds) == words
