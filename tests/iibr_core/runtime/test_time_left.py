"""Time left is predicted from this run's own steps: late enough, near the truth, and steadily."""

import numpy as np
import pytest

from iibr_core.runtime.time_left import TimeLeft, about_left


class Clock:
    """A clock that is set by hand."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


def predictions(step_s, work=None):
    """(share done, predicted seconds left or None, true seconds left) after each step of a job; of equal work unless
    said otherwise."""
    work = np.ones(len(step_s)) if work is None else np.asarray(work, float)
    clock = Clock()
    time_left, total = TimeLeft(clock), work.sum()
    said = [(0.0, time_left.update(0, total), float(np.sum(step_s)))]
    for i, seconds in enumerate(step_s):
        clock.now += seconds
        done = work[: i + 1].sum()
        said.append((done / total, time_left.update(done, total), float(np.sum(step_s[i + 1 :]))))
    return said


def worst_factor(said, since=0.0, until=0.95):
    """By how much the predictions are off at most while so much of the work is done."""
    factors = [max(left / true, true / left) for share, left, true in said if left and since <= share <= until]
    assert factors
    return max(factors)


def test_equal_steps_are_predicted_exactly():
    said = predictions([2.0] * 20)
    assert worst_factor(said) == pytest.approx(1.0)
    assert said[-1][1] == 0.0


def test_nothing_is_said_before_enough_was_measured():
    said = predictions([2.0] * 20)
    assert [left for _, left, _ in said[:3]] == [None] * 3
    assert said[3][1] is not None


def test_nothing_is_said_within_the_first_second():
    said = predictions([0.01] * 80)
    assert all(left is None for _, left, _ in said[:-1])


def test_the_first_step_which_compiles_is_not_measured():
    assert worst_factor(predictions([30.0] + [1.0] * 30)) == pytest.approx(1.0)


def test_work_that_is_not_equal_counts_as_stated():
    work = [9.0] * 8 + [1.0] * 72
    assert worst_factor(predictions(0.5 * np.array(work), work)) == pytest.approx(1.0)


def test_a_change_of_pace_is_soon_forgotten():
    said = predictions([5.0] * 8 + [0.5] * 72)
    assert worst_factor(said, since=0.3) < 1.1


@pytest.mark.parametrize("at_once", [2, 3])
def test_steps_that_end_together_do_not_mislead(at_once):
    said = predictions(([4.0] + [0.01] * (at_once - 1)) * 10)
    assert worst_factor(said, until=0.8) < 1.7
    assert worst_factor(said, since=0.25, until=0.5) < 1.35


def test_predicted_end_is_steady_for_steps_that_vary():
    rng = np.random.default_rng(3)
    step_s = rng.uniform(0.5, 1.5, 100)
    passed = np.cumsum([0.0, *step_s])
    ends = [passed[i] + left for i, (share, left, _) in enumerate(predictions(step_s)) if left is not None and i > 10]
    assert np.abs(np.diff(ends)).max() < 0.1 * passed[-1]


def test_it_counts_down_between_steps_and_is_silent_where_a_step_stalls():
    clock = Clock()
    time_left = TimeLeft(clock)
    for done in range(6):
        time_left.update(done, 10)
        clock.now += 10.0
    clock.now -= 10.0
    at_step = time_left.update(5, 10)
    clock.now += 4.0
    assert time_left.update(5, 10) == pytest.approx(at_step - 4.0, rel=0.1)
    clock.now += 100.0
    assert time_left.update(5, 10) is None


def test_frequent_updates_between_steps_change_little():
    clock = Clock()
    time_left = TimeLeft(clock)
    for frame in range(1000):
        left = time_left.update(frame // 100, 20)
        clock.now += 0.1
    assert left == pytest.approx(200 - 99.9, rel=0.2)


def test_unknown_work_gives_no_prediction():
    clock = Clock()
    time_left = TimeLeft(clock)
    for done in range(10):
        assert time_left.update(done, 0) is None
        clock.now += 1.0


def test_the_share_only_grows_and_ends_at_one_where_the_work_turns_out_to_be_more():
    time_left, shares = TimeLeft(Clock()), []
    for done, total in [(0, 0), (0, 10), (2, 10), (4, 10), (5, 100), (50, 100), (50, 60), (60, 60)]:
        time_left.update(done, total)
        shares.append(time_left.share)
    assert shares[:4] == pytest.approx([0.0, 0.0, 0.2, 0.4])
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_a_long_job_keeps_few_samples():
    clock = Clock()
    time_left = TimeLeft(clock)
    for done in range(20_000):
        time_left.update(done, 20_000)
        clock.now += 0.01
    assert len(time_left._samples) < 500


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "about 1 s left"), (8.4, "about 8 s left"), (41, "about 40 s left"), (61, "about 60 s left"),
     (185, "about 3 min left"), (7200, "about 2.0 h left")],
)  # fmt: skip
def test_words_are_as_rough_as_the_prediction(seconds, words):
    assert about_left(seconds) == words
