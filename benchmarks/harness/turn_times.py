"""How long turns of the window's loop keep its thread busy, and with which of their stages."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from viewer.app.main_loop import App

REST = "the rest"


@dataclass(frozen=True, order=True)
class Turn:
    """Processor time of a turn, and of its longest stage."""

    seconds: float = 0.0
    stage: str = REST
    stage_s: float = 0.0

    def __str__(self) -> str:
        return f"{1e3 * self.seconds:.0f} ms, {1e3 * self.stage_s:.0f} of them: {self.stage}"


@dataclass
class Turns:
    """The turns that were watched. longest: the one that took longest."""

    longest: Turn = field(default_factory=Turn)


def stages_of(app: App) -> dict[str, tuple[Any, str]]:
    """Return the stages of a turn: the object and the method of each."""
    return {
        "results taken in": (app.scene_loader, "take_results"),
        "views uploaded": (app.scene_view, "upload"),
        "programs prepared": (app._preparation, "advance"),
        "picture drawn": (app.scene_view, "draw"),
        "inspection drawn": (app.inspection_view, "draw"),
        "frame shown": (app, "_show"),
        "files asked for": (app._side_effects, "run"),
        "files drawn": (app._side_effects, "draw"),
        "work asked for": (app.scene_loader, "advance"),
    }


@contextmanager
def watched_turns(app: App) -> Iterator[Turns]:
    """Measure the turns of the loop in the block, in the thread that calls this: drivers' threads are not counted."""
    turns, spent = Turns(), dict[str, float]()
    stages = stages_of(app)
    for name, (owner, method) in stages.items():
        setattr(owner, method, _timed(getattr(owner, method), name, spent))
    step = app.step

    def watched_step() -> None:
        spent.clear()
        began = time.thread_time()
        step()
        seconds = time.thread_time() - began
        stage = max(spent, key=lambda name: spent[name])
        turns.longest = max(turns.longest, Turn(seconds, stage, spent[stage]))

    app.step = watched_step  # type: ignore[method-assign]
    try:
        yield turns
    finally:
        del app.step
        for owner, method in stages.values():
            delattr(owner, method)


def _timed(work: Callable[..., Any], name: str, spent: dict[str, float]) -> Callable[..., Any]:
    def timed(*given: Any, **named: Any) -> Any:
        before, began = sum(spent.values()), time.thread_time()
        try:
            return work(*given, **named)
        finally:
            within = sum(spent.values()) - before  # stages within this one count as their own
            spent[name] = spent.get(name, 0.0) + time.thread_time() - began - within

    return timed
