"""The time that a job still takes."""

from types import SimpleNamespace

import pytest

from iibr_core.runtime.time_left import TimeLeft, about_left


def test_equal_steps_are_predicted_once_the_pace_is_known_and_it_counts_down_between() -> None:
    clock = SimpleNamespace(now=100.0)
    left, predictions = TimeLeft(lambda: clock.now), []
    assert left.update(0, 0) is None, "unknown work"
    for done in range(1, 6):
        clock.now += 5.0 if done == 1 else 2.0  # the first compiles kernels
        predictions.append(left.update(done, 10))
    assert predictions == [None, 16.0, 14.0, 12.0, 10.0]
    assert left.share == 0.5
    clock.now += 1.0
    assert left.update(5, 10) == 9.0
    clock.now += 60.0
    assert left.update(5, 10) == 0.0
    left.update(6, 20)
    assert left.share == 0.5, "more to do takes no progress back"
    assert left.update(1, 10, "another stage") is None
    assert left.share == 0.1


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "about 1 s left"), (8.4, "about 8 s left"), (42, "about 40 s left"), (89, "about 90 s left"),
     (185, "about 3 min left"), (7200, "about 2.0 h left")],
)  # fmt: skip
def test_words(seconds: float, words: str) -> None:
    assert about_left(seconds) == words
