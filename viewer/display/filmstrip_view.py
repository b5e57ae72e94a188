"""The photos of the folder in small, as they are read, beside the window's thread."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewer.background.job_threads import Failed, Job, JobThread
from viewer.gpu.context import GLContext
from viewer.gpu.thumbnails import CELL, ThumbnailTexture
from viewer.model.state.folder import Thumbnail


@dataclass(frozen=True, eq=False)
class ThumbnailRead:
    """A photo in small, (h, w, 3); None where it cannot be read."""

    path: str
    pixels: NDArray[np.uint8] | None


class FilmstripView:
    """Everything is called from the one GL thread."""

    def __init__(self, gl: GLContext, wake: Callable[[], None]) -> None:
        """wake: called, in the reading thread, when a photo was read."""
        self._ctx = gl.ctx
        self._texture: ThumbnailTexture | None = None
        self._thread: JobThread[tuple[str, ...], ThumbnailRead | Failed[None]] = JobThread(
            "iibr-thumbnails", wake, _read, lambda request, message: Failed(None, message)
        )
        self._unreadable: set[str] = set()
        self._asked: tuple[str, ...] = ()

    def thumbnails(self, paths: tuple[str, ...]) -> dict[str, Thumbnail | None]:
        """Those of these photos that are there by now, None of what cannot be read; the others are being read."""
        if not paths:
            return {}
        self._texture = self._texture or ThumbnailTexture(self._ctx)
        while (result := self._thread.next_result()) is not None:
            if isinstance(result, ThumbnailRead):
                self._take(result, self._texture)
        found = {path: self._texture.get(path) for path in paths}
        missing = tuple(path for path in paths if found[path] is None and path not in self._unreadable)
        if missing and not set(missing) <= set(self._asked):
            self._asked = missing
            self._thread.submit(missing)
        return {path: found[path] for path in paths if found[path] is not None or path in self._unreadable}

    def release(self) -> None:
        """Stop reading and free the texture."""
        self._thread.close()
        if self._texture is not None:
            self._texture.release()

    def _take(self, result: ThumbnailRead, texture: ThumbnailTexture) -> None:
        if result.pixels is None:
            self._unreadable.add(result.path)
        else:
            texture.put(result.path, result.pixels)


def _read(job: Job[tuple[str, ...], ThumbnailRead | Failed[None]]) -> Iterator[ThumbnailRead]:
    from iibr_core.formats.images.photo import read_thumbnail

    for path in job.request:
        try:
            yield ThumbnailRead(path, read_thumbnail(Path(path), CELL))
        except Exception:  # opening the photo says what is wrong with it
            yield ThumbnailRead(path, None)
