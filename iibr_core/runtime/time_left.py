"""Predict how long a job still takes, from the pace that this run has measured."""

from __future__ import annotations

import time
from collections.abc import Callable

LEAST_S = 1.0
"""Measured before anything is predicted: shorter jobs need no prediction."""


class TimeLeft:
    """The time left of one job; call `update` often. share: of the work that is done, 0..1; it only grows."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        """Begin a job. clock: the time in seconds, from any origin."""
        self.share = 0.0
        self._clock = clock
        self.restart()

    def restart(self) -> None:
        """Forget the pace: work of another kind begins."""
        self._first: tuple[float, float] | None = None
        self._last = (self._clock(), 0.0)

    def update(self, done: float, total: float) -> float | None:
        """Return the seconds left, None while they are unknown. done, total: work in any unit; total may change.

        The first step is not measured: it compiles kernels and fills caches.
        """
        now = self._clock()
        if total > 0:
            self.share = max(self.share, min(done / total, 1.0))
        if done > self._last[1]:
            self._last = (now, done)
            self._first = self._first or self._last
        if self._first is None or self._last[1] <= self._first[1] or now - self._first[0] < LEAST_S:
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
