"""A save, copy or export as it was asked for: all that it shows is of that moment, whatever the window shows later."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from iibr_core.beyond.optics import Optics
from iibr_core.exports.source import ExportSource
from iibr_core.runtime.time_left import TimeLeft
from iibr_core.scenes.scene import Scene, SceneRequest
from viewer.display.snapshot import SceneSnapshot
from viewer.model.action import Action
from viewer.model.carried_optics import carry_optics
from viewer.model.state.app_state import AppState
from viewer.model.state.jobs import STOPPING, WAITING_FOR_VIEWS, JobKind, JobProgress

Needs = Literal["shown", "scene", "views"]
"""What of the scene must be there before a job begins: what is on the screen; its photo and plan; all its views."""
Lane = Literal["pictures", "exports"]
"""Jobs of one lane follow each other: a picture need not wait for a long export."""


@dataclass(eq=False)
class Job:
    """state: of the window when it was asked for. needs: asked again as more of the scene is known. work: what it does,
    in a thread; what comes of it is returned. pictures: finds what those that it draws are taken
    with. takes_part: of the views will do where the user makes no more.

    generation: whose views it shows; request: makes the same once more, where is_left: the window does not make them.
    snapshot: None until it is there.
    """

    kind: JobKind
    path: Path
    state: AppState
    needs: Callable[[Scene, Optics], Needs]
    work: Callable[[ExportSource], list[Action]]
    pictures: Callable[[Scene, Optics], Iterable[Optics]] = lambda scene, optics: (optics,)
    takes_part: bool = False
    id: int = 0
    generation: int = 0
    request: SceneRequest | None = None
    snapshot: SceneSnapshot | None = None
    is_left: bool = False
    is_running: bool = False
    is_given_up: threading.Event = field(default_factory=threading.Event)
    _reported: tuple[float, float, str] = (0.0, 0.0, "")
    _time_left: TimeLeft = field(default_factory=TimeLeft)

    @property
    def lane(self) -> Lane:
        """Where it waits for its turn."""
        return "exports" if self.kind == "export" else "pictures"

    @property
    def should_stop(self) -> Callable[[], bool]:
        """For what it does."""
        return self.is_given_up.is_set

    def report(self, done: float, total: float, doing: str) -> None:
        """In whatever thread works: how far it is with what it is doing now."""
        self._reported = (done, total, doing)

    def optics_on(self, scene: Scene) -> Optics:
        """What its pictures are taken with, on the scene that it shows."""
        asked = self.state.scene
        return self.state.optics if scene == asked else carry_optics(self.state.optics, asked, scene)

    def describe(self) -> JobProgress:
        """For the window; changes at most a hundred times a stage, and with the seconds left."""
        name = "the picture" if self.kind == "copy" else self.path.name
        if self.is_given_up.is_set():
            return JobProgress(self.id, self.kind, name, STOPPING)
        if not self.is_running:
            doing = "" if self.snapshot or self.is_left else WAITING_FOR_VIEWS
            return JobProgress(self.id, self.kind, name, doing)
        done, total, doing = self._reported
        left_s = self._time_left.update(done, total, doing)
        share = int(100 * done / total) / 100 if total else 0.0
        left_s = None if left_s is None else float(round(left_s))
        return JobProgress(self.id, self.kind, name, doing, share, left_s)
