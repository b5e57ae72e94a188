"""The next photos of a folder, read and planned before they are asked for, as many as fit the memory budget."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from iibr_core.generation.memory_model import KEPT_BYTES, READING_BYTES, budget_of, whole_bytes
from iibr_core.generation.plan import ScenePlan
from iibr_core.runtime.allocator import give_back_memory
from viewer.background.jobs import Failed, Job, JobThread
from viewer.background.loaded_photo import LoadedPhoto, load_photo, make_plan
from viewer.model.state.scene import Scene, Source


@dataclass(frozen=True, eq=False)
class PhotoAhead:
    """A photo that is ready to be shown: read, its depth found, its views planned with this depth strength."""

    source: Source
    depth_strength: float
    loaded: LoadedPhoto
    plan: ScenePlan


@dataclass(frozen=True, eq=False)
class AheadRequest:
    """A photo to be read."""

    source: Source
    depth_strength: float


def photos_within_budget(scene: Scene) -> int:
    """How many photos like the open one fit beside it and its views."""
    plan, pixels = scene.plan, scene.width * scene.height
    if plan is None:
        return 0
    room = budget_of(scene.source.depth.memory_bytes).bytes
    room -= whole_bytes(pixels, plan.field_bytes, plan.peak_bytes + plan.draft_bytes, keeps_views=True)
    return max(math.floor((room - pixels * READING_BYTES) / (pixels * KEPT_BYTES)), 0)


class PhotosAhead:
    """Reads what it is told to want, one after the other, and keeps that until it is taken or wanted no more."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the reading thread, when a photo was read."""
        self._thread: JobThread[AheadRequest, PhotoAhead | Failed[Source]] = JobThread(
            "iibr-ahead", wake, _read, lambda request, message: Failed(request.source, message)
        )
        self._ready: dict[Source, PhotoAhead] = {}
        self._failed: set[Source] = set()
        self._reading: Source | None = None

    @property
    def ready(self) -> tuple[Source, ...]:
        """What is here to be taken."""
        self._take_results()
        return tuple(self._ready)

    def want(self, sources: Sequence[Source], depth_strength: float) -> None:
        """Read these, the first first; drop all others."""
        self._take_results()
        strength = depth_strength
        self._ready = {s: p for s, p in self._ready.items() if s in sources and p.depth_strength == strength}
        self._failed.intersection_update(sources)
        if self._reading is not None and self._reading not in sources:
            self._thread.cancel()
            self._reading = None
        missing = [s for s in sources if s not in self._ready and s not in self._failed]
        if self._reading is None and missing and not self._thread.is_lost:
            self._reading = missing[0]
            self._thread.submit(AheadRequest(missing[0], strength))

    def keep(self, photo: PhotoAhead) -> None:
        """One that was read already may be wanted again."""
        self._ready[photo.source] = photo

    def take(self, source: Source, depth_strength: float) -> PhotoAhead | None:
        """What was read of this, if it was; it is kept here no longer."""
        self._take_results()
        photo = self._ready.pop(source, None)
        return photo if photo is not None and photo.depth_strength == depth_strength else None

    def is_reading(self, source: Source) -> bool:
        """Whether it is under way."""
        self._take_results()
        return self._reading == source and not self._thread.is_lost

    def close(self) -> None:
        """Stop reading."""
        self._thread.close()
        self._ready.clear()

    def _take_results(self) -> None:
        while (result := self._thread.next_result()) is not None:
            self._reading = None
            if isinstance(result, Failed):
                self._failed.add(result.id)  # opening it will say why
            else:
                self._ready[result.source] = result


def _read(job: Job[AheadRequest, PhotoAhead | Failed[Source]]) -> Iterator[PhotoAhead]:
    source, strength = job.request.source, job.request.depth_strength
    loaded = load_photo(source, job.should_stop)
    plan = make_plan(source, loaded, strength)
    give_back_memory()
    yield PhotoAhead(source, strength, loaded, plan)
