"""How long a job still takes, predicted from what this run has measured: no constants of any machine.

The first step is not measured: it compiles kernels and fills caches. The rate is that of the later half of the work
done since, so a change of pace is soon forgotten.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

LEAST_STEPS = 2
"""Measured after the first before anything is predicted."""
LEAST_S = 1.0
"""Measured before anything is predicted: who waits less needs no prediction."""
LEAST_SAMPLES = 8
"""Kept, however little work they span: several at a time, steps end in rounds, and a window must hold whole ones."""
SAMPLE_SHARE = 0.01
"""Of the time measured: samples closer together add nothing."""
STALLED = 3.0
"""A step that takes so many times as long as those before it makes the prediction void."""


class TimeLeft:
    """Of one job. `update` it whenever the job advances, and in between to count down. share: of the work that is done,
    0..1; it only grows, also where there turns out to be more to do.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        """clock: the time in seconds, from any origin."""
        self.share = 0.0
        self._clock = clock
        self._samples: deque[tuple[float, float]] = deque()  # (time, work done)
        self._first: tuple[float, float] | None = None
        self._advanced: tuple[float, float] | None = None
        self._step, self._steps, self._done = 0.0, 0, 0.0

    def update(self, done: float, total: float) -> float | None:
        """Seconds left, None while they are unknown. done, total: work in any unit, with equal time for equal work.

        done does not shrink; total may change.
        """
        now = self._clock()
        self._grow(done, total)
        self._measure(now, done)
        if done >= total > 0:
            return 0.0
        rate = self._rate(now)
        if rate is None or self._advanced is None or total <= 0:
            return None
        waited, step = now - self._advanced[0], self._step / rate
        if waited > max(STALLED * step, LEAST_S):
            return None
        return max((total - done) / rate - min(waited, step), 0.0)

    def restart(self) -> None:
        """Forget the pace: work of another kind begins."""
        self._samples.clear()
        self._first, self._steps = None, 0

    def _grow(self, done: float, total: float) -> None:
        """What was done since the last time comes from what was left then."""
        step, left = max(done - self._done, 0.0), max(total - done, 0.0)
        self._done = max(done, self._done)
        if total > 0:
            self.share += (1.0 - self.share) * (step / (step + left) if step + left > 0 else 1.0)

    def _measure(self, now: float, done: float) -> None:
        if self._advanced is not None and done <= self._advanced[1]:
            return
        before, self._advanced = self._advanced, (now, done)
        if before is None:
            return  # the job begins
        self._step, self._steps = done - before[1], self._steps + 1
        if self._first is None:
            self._first = self._advanced
        if not self._samples or now - self._samples[-1][0] >= SAMPLE_SHARE * (now - self._first[0]):
            self._samples.append(self._advanced)
        middle = 0.5 * (self._first[1] + done)
        while len(self._samples) > LEAST_SAMPLES and self._samples[0][1] < middle:
            self._samples.popleft()

    def _rate(self, now: float) -> float | None:
        """Work per second: the slope of the least-squares line, which steps that end in pairs do not mislead."""
        if self._first is None or self._steps <= LEAST_STEPS or now - self._first[0] < LEAST_S:
            return None
        count = len(self._samples)
        mean_s, mean_done = (sum(sample[axis] for sample in self._samples) / count for axis in (0, 1))
        spread = sum((at - mean_s) ** 2 for at, _ in self._samples)
        rate = sum((at - mean_s) * (done - mean_done) for at, done in self._samples) / spread if spread > 0 else 0.0
        return rate if rate > 0 else None


def about_left(seconds: float) -> str:
    """Seconds for people, rounded as a prediction is: "about 8 s left", "about 40 s left", "about 3 min left"."""
    if seconds >= 5400:
        return f"about {seconds / 3600:.1f} h left"
    if seconds >= 90:
        return f"about {seconds / 60:.0f} min left"
    coarse = 1 if seconds < 10 else 5
    return f"about {max(coarse * round(seconds / coarse), 1)} s left"
