"""How far it is to open a photo or a light field, over all stages, and how long it still takes."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal

from iibr_core.runtime.time_left import TimeLeft
from iibr_core.scenes.scene import Progress

Stage = Literal["reading", "searching", "drafting", "matching", "carrying"]
FINDING = "finding disparity"
READ_WORK, SEARCH_WORK, MATCH_WORK = 0.2, 3.0, 30.0
"""Costs of reading a view, of the small map and of the whole map, relative to carrying disparity to a view, until this
run has measured them.
"""
LEAST_CARRIED = 3

MeasureViews = Callable[[int, int, float], Progress]
"""(views there, drafts among them, share of the work on them) -> how far the whole job is."""


class ViewsWork:
    """Progress of making views. views: their number."""

    def __init__(self, views: int, clock: Callable[[], float] = time.perf_counter) -> None:
        self._views, self._clock, self._time_left = views, clock, TimeLeft(clock)
        self._begun = clock()

    def advance(self, work: tuple[float, float], there: int = 0, drafts: int = 0, doing: str = "") -> Progress:
        """work: done, and in all. there: views."""
        left_s = self._time_left.update(*work)
        seconds = self._clock() - self._begun
        return Progress(there, self._views, seconds, doing, drafts, self._time_left.share, left_s)


class OpeningWork:
    """Counts work in views that disparity is carried to. The time left is known from the first of them on."""

    def __init__(
        self,
        views: int,
        finds: bool,
        drafts: bool,
        carries: bool = True,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        """finds: the views bring no disparity. drafts: they are shown with the small map too. carries: disparity is
        carried from the centre view to the others.
        """
        self._views, self._clock, self._time_left = views, clock, TimeLeft(clock)
        self._work: dict[Stage, float] = {"reading": READ_WORK * views}
        if finds:
            self._work["searching"] = SEARCH_WORK
        if finds and drafts:
            self._work["drafting"] = views
        if finds:
            self._work["matching"] = MATCH_WORK
        if carries:
            self._work["carrying"] = views
        self._stage: Stage = "reading"
        self._begun = self._stage_begun = clock()
        self._match_s: float | None = None

    def knows_search(self, times_dearer: float) -> None:
        """The small map is there; the whole one takes so many times as long."""
        self._match_s = times_dearer * (self._clock() - self._stage_begun)

    def measuring(self, stage: Stage) -> MeasureViews:
        """How far it is with the views of a stage."""
        return lambda there, drafts, share: self.advance(stage, share)

    def advance(self, stage: Stage, share: float) -> Progress:
        """Return the progress after this share of a stage, 0..1, and all stages before it."""
        if stage != self._stage:
            if stage == "drafting" or (stage == "carrying" and "drafting" not in self._work):
                self._time_left.restart()
            self._stage, self._stage_begun = stage, self._clock()
        carried = share * self._views
        if stage == "drafting" and self._match_s is not None and carried >= LEAST_CARRIED:
            self._work["matching"] = self._match_s * carried / max(self._clock() - self._stage_begun, 1e-6)
        stages = list(self._work)
        before = sum(self._work[each] for each in stages[: stages.index(stage)])
        left_s = self._time_left.update(before + share * self._work[stage], sum(self._work.values()))
        is_last = stage == stages[-1]
        return Progress(
            round(carried) if is_last or stage == "reading" else self._views,
            self._views,
            self._clock() - self._begun,
            "" if is_last and share >= 1 else "reading views" if stage == "reading" else FINDING,
            0 if is_last else self._views,
            self._time_left.share,
            left_s if is_last or stage in ("drafting", "matching") else None,
        )
