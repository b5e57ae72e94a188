"""Thumbnails of the photos of a folder, read beside the window's thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import ImageSize
from viewer.background.newest import Newest, Post
from viewer.gpu.context import GLContext
from viewer.gpu.thumbnails import ThumbnailTextures
from viewer.model.state.folder import Thumbnail

MAX_SIZE = ImageSize(height=96, width=144)
"""Largest size of a thumbnail in pixels."""


@dataclass(frozen=True, eq=False)
class ThumbnailRead:
    """A thumbnail, (h, w, 3); None if the photo cannot be read."""

    path: str
    pixels: NDArray[np.uint8] | None


class FilmstripView:
    """Reads and keeps thumbnails. Call it only from the thread of the window."""

    def __init__(self, gl: GLContext, wake: Callable[[], None]) -> None:
        """wake: called, in the reading thread, when a photo was read."""
        self._textures = ThumbnailTextures(gl.ctx)
        self._reader: Newest[tuple[str, ...], ThumbnailRead] = Newest("iibr-thumbnails", _read, wake)
        self._unreadable: set[str] = set()
        self._requested: tuple[str, ...] = ()

    def thumbnails(self, paths: tuple[str, ...]) -> dict[str, Thumbnail | None]:
        """Return the thumbnails of these photos that were read, None for unreadable photos; read the others."""
        while (result := self._reader.next_result()) is not None:
            if isinstance(result, ThumbnailRead):
                self._take(result)
        found = {path: self._textures.get(path) for path in paths}
        missing = tuple(path for path in paths if found[path] is None and path not in self._unreadable)
        if missing and not set(missing) <= set(self._requested):
            self._requested = missing
            self._reader.submit(missing)
        return {
            path: None if texture is None else Thumbnail(texture.name, texture.aspect)
            for path, texture in found.items()
            if texture is not None or path in self._unreadable
        }

    def release(self) -> None:
        """Stop reading and free the textures."""
        self._reader.close()
        self._textures.release()

    def _take(self, result: ThumbnailRead) -> None:
        if result.pixels is None:
            self._unreadable.add(result.path)
        else:
            self._textures.put(result.path, result.pixels)


def _read(paths: tuple[str, ...], post: Post[ThumbnailRead]) -> None:
    from iibr_core.formats.images.photo import read_thumbnail

    for path in paths:
        try:
            pixels = read_thumbnail(Path(path), MAX_SIZE)
        except Exception:  # opening the photo shows what is wrong with it
            post(ThumbnailRead(path, None))
        else:
            post(ThumbnailRead(path, pixels))
