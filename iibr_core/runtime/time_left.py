"""Predict how long a job still takes, from the pace that this run has measured."""

from __future__ import annotations

import time
from collections.abc import Callable

MIN_MEASURED_S = 1.0
"""Seconds that are measured before anything is predicted: shorter jobs need no prediction."""


class TimeLeft:
    """Prediction for the present stage of a job; call `update` often. share: share of the stage that is done, 0..1."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        """Begin a job. clock: the time in seconds, from any origin."""
        self._clock = clock
        self._begin("")

    def _begin(self, doing: str) -> None:
        self.share, self._doing = 0.0, doing
        self._first: tuple[float, float] | None = None
        self._last = (self._clock(), 0.0)

    def update(self, done: float, total: float, doing: str = "") -> float | None:
        """Return the seconds left, None while they are unknown.

        done, total: amounts of work in any unit. doing: the work in words; other words begin a new stage. The first
        step is not measured: it compiles kernels and fills caches.
        """
        if doing != self._doing:
            self._begin(doing)
        now = self._clock()
        if total > 0:
            self.share = max(self.share, min(done / total, 1.0))
        if done > self._last[1]:
            self._last = (now, done)
            self._first = self._first or self._last
        if self._first is None or self._last[1] <= self._first[1] or now - self._first[0] < MIN_MEASURED_S:
            return None
        pace = (self._last[0] - self._first[0]) / (self._last[1] - self._first[1])
        return max((total - done) * pace - (now - self._last[0]), 0.0)


def about_left(seconds: float) -> str:
    """Return seconds in words, rounded as a prediction is: "about 8 s left", "about 40 s left", "about 3 min left"."""
    if seconds >= 5400:
        return f"about {seconds / 3600:.1f} h left"
    if seconds >= 90:
        return f"about {seconds / 60:.0f} min left"
    coarse = 1 if seconds < 10 else 5
    return f"about {max(coarse * round(seconds / coarse), 1)} s left"
