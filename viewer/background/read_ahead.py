"""Photos read before they are asked for: small ones to be shown at once, and whole ones, as many as fit in memory."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from iibr_core.method.memory import PHOTO_BYTES, budget_bytes
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto, Scene, SceneReady, WantedPhoto
from viewer.background.newest import Failed, Newest, Post

Read = TypeVar("Read")


@dataclass(frozen=True, eq=False)
class PhotoAhead:
    """A photo that is ready to be shown: read, with its depth and its plan."""

    loaded: LoadedPhoto
    plan: ScenePlan


def read_whole_photo(wanted: WantedPhoto) -> PhotoAhead:
    """Read and plan a photo without asking a depth model. Raises InputError."""
    from iibr_core.scenes.photo import load_photo, make_plan

    loaded = load_photo(wanted.source, asks_model=False)
    return PhotoAhead(loaded, make_plan(wanted.source, loaded, wanted.depth_strength))


def read_sketch(wanted: WantedPhoto) -> SceneReady | None:
    """Return a large photo at a small size, see `sketch_of`."""
    from iibr_core.scenes.opening import sketch_of

    return sketch_of(wanted)


def photos_within_budget(scene: Scene) -> int:
    """Return how many photos like the open one fit in memory beside it and its views."""
    if scene.plan is None:
        return 0
    return math.floor(budget_bytes() / (2 * scene.width * scene.height * PHOTO_BYTES))


class ReadAhead(Generic[Read]):
    """Reads wanted photos in a thread, one after the other, and keeps them as long as they are wanted."""

    def __init__(self, name: str, wake: Callable[[], None], read: Callable[[WantedPhoto], Read | None]) -> None:
        """wake: called, in the thread, when a photo was read. read: its errors are dropped; opening will show them."""

        def work(wanted: WantedPhoto, post: Post[tuple[WantedPhoto, Read | None]]) -> None:
            post((wanted, read(wanted)))

        self._thread = Newest(name, work, wake)
        self._photos: dict[WantedPhoto, Read | None] = {}
        self._reading: WantedPhoto | None = None
        self.close = self._thread.close

    def want(self, wanted: Sequence[WantedPhoto]) -> None:
        """Read these photos, the first one at once, even if another one is being read; forget all others."""
        self._photos = {photo: read for photo, read in self._known.items() if photo in wanted}
        missing = [photo for photo in wanted if photo not in self._photos]
        is_urgent = missing[:1] == list(wanted[:1])
        if self._reading is not None and self._reading not in (missing[:1] if is_urgent else missing):
            self._thread.cancel()
            self._reading = None
        if self._reading is None and missing:
            self._reading = missing[0]
            self._thread.submit(missing[0])

    def is_done(self, photo: WantedPhoto) -> bool:
        """Return whether a photo was read, or cannot be read."""
        return photo in self._known

    def is_reading(self, photo: WantedPhoto) -> bool:
        """Return whether a photo is being read."""
        return photo not in self._known and self._reading == photo

    def get(self, photo: WantedPhoto) -> Read | None:
        """Return a photo if it was read."""
        return self._known.get(photo)

    def keep(self, photo: WantedPhoto, read: Read) -> None:
        """Keep a photo that was read elsewhere while it is wanted."""
        self._photos[photo] = read

    @property
    def _known(self) -> dict[WantedPhoto, Read | None]:
        """The photos read so far, with the results that have come in; None for a photo that cannot be read."""
        while (result := self._thread.next_result()) is not None:
            photo, read = (result.request, None) if isinstance(result, Failed) else result
            self._reading, self._photos[photo] = None, read
        return self._photos
