"""Photos read before they are asked for: in small, to be shown at once, and whole, as many as fit the memory budget."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from iibr_core.method.memory import PHOTO_BYTES, budget_bytes
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto, Scene, SceneReady, WantedPhoto
from viewer.background.job_threads import Job, JobThread

Read = TypeVar("Read")


_Job = Job[WantedPhoto, tuple[WantedPhoto, Read | None]]


@dataclass(frozen=True, eq=False)
class PhotoAhead:
    """A photo that is ready to be shown: read, its depth found, its views planned."""

    loaded: LoadedPhoto
    plan: ScenePlan


def read_whole_photo(wanted: WantedPhoto) -> PhotoAhead:
    """Read all of a photo, asking no depth model. Raises InputError."""
    from iibr_core.scenes.photo import load_photo, make_plan

    loaded = load_photo(wanted.source, asks_model=False)
    plan = make_plan(wanted.source, loaded, wanted.depth_strength)
    return PhotoAhead(loaded, plan)


def read_sketch(wanted: WantedPhoto) -> SceneReady | None:
    """Return a large photo at a small size, see `sketch_of`."""
    from iibr_core.scenes.opening import sketch_of

    return sketch_of(wanted)


def photos_within_budget(scene: Scene) -> int:
    """How many photos like the open one fit beside it and its views."""
    plan, pixels = scene.plan, scene.width * scene.height
    if plan is None:
        return 0
    return math.floor(budget_bytes() / (2 * pixels * PHOTO_BYTES))


class ReadAhead(Generic[Read]):
    """Reads what it is told to want, one after the other, and keeps that as long as it is wanted."""

    def __init__(self, name: str, wake: Callable[[], None], read: Callable[[WantedPhoto], Read | None]) -> None:
        """name: of the thread that reads. wake: called there when a photo was read. read: gives None where there is
        nothing to be had; errors mean the same: opening the photo will say why.
        """

        def read_one(job: _Job[Read]) -> Iterator[tuple[WantedPhoto, Read | None]]:
            yield job.request, read(job.request)

        self._thread = JobThread(name, wake, read_one, lambda wanted, message: (wanted, None))
        self._known: dict[WantedPhoto, Read | None] = {}
        self._reading: WantedPhoto | None = None

    def want(self, wanted: Sequence[WantedPhoto]) -> None:
        """Read these, the first first, and at once: another one that is being read can wait. Drop all others."""
        self._take_results()
        self._known = {photo: read for photo, read in self._known.items() if photo in wanted}
        missing = [photo for photo in wanted if photo not in self._known]
        is_urgent = bool(missing) and missing[0] == wanted[0]
        if self._reading is not None and self._reading not in (missing[:1] if is_urgent else missing):
            self._thread.cancel()
            self._reading = None
        if self._reading is None and missing and not self._thread.is_lost:
            self._reading = missing[0]
            self._thread.submit(missing[0])

    def is_done(self, photo: WantedPhoto) -> bool:
        """Whether there is no use in waiting for it: it was read, or cannot be."""
        self._take_results()
        return photo in self._known or self._thread.is_lost

    def is_reading(self, photo: WantedPhoto) -> bool:
        """Whether it is under way."""
        self._take_results()
        return self._reading == photo and not self._thread.is_lost

    def get(self, photo: WantedPhoto) -> Read | None:
        """What was read of it, if it was."""
        self._take_results()
        return self._known.get(photo)

    def keep(self, photo: WantedPhoto, read: Read) -> None:
        """One that was read already may be wanted again."""
        self._known[photo] = read

    def close(self) -> None:
        """Stop reading."""
        self._thread.close()
        self._known.clear()

    def _take_results(self) -> None:
        while (result := self._thread.next_result()) is not None:
            self._reading = None
            self._known[result[0]] = result[1]
