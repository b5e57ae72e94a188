"""Thumbnails of the photos of a folder, read beside the window's thread, on the graphics card."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import ImageSize
from viewer.background.newest import Failed, Newest, Post
from viewer.gpu.context import GLContext
from viewer.model.folder import Thumbnail

MAX_SIZE = ImageSize(height=96, width=144)
"""Largest size of a thumbnail in pixels."""
MAX_THUMBNAILS = 224
"""Number of thumbnails that are kept."""

ThumbnailRead = tuple[str, NDArray[np.uint8] | None]
"""Path of a photo and its thumbnail, (h, w, 3); None if the photo cannot be read."""


class FilmstripView:
    """Reads and keeps thumbnails. Call it only from the thread of the window."""

    def __init__(self, gl: GLContext, wake: Callable[[], None]) -> None:
        """wake: called, in the reading thread, when a photo was read."""
        self._ctx = gl.ctx
        self._reader: Newest[tuple[str, ...], ThumbnailRead] = Newest("iibr-thumbnails", _read, wake)
        self._textures: dict[str, Any] = {}
        self._requested: tuple[str, ...] = ()

    def thumbnails(self, paths: tuple[str, ...]) -> dict[str, Thumbnail | None]:
        """Return the thumbnails of these photos that were read, None for unreadable photos; read the others."""
        while (result := self._reader.next_result()) is not None:
            if not isinstance(result, Failed):
                self._keep(*result)
        missing = tuple(path for path in paths if path not in self._textures)
        if not set(missing) <= set(self._requested):
            self._requested = missing
            self._reader.submit(missing)
        for path in set(paths).difference(missing):  # asked for last
            self._textures[path] = self._textures.pop(path)
        found = {path: self._textures[path] for path in paths if path in self._textures}
        return {path: Thumbnail(it.glo, it.width / it.height) if it is not None else None for path, it in found.items()}

    def release(self) -> None:
        """Stop reading and free the textures."""
        self._reader.close()
        while self._textures:
            self._forget_oldest()

    def _keep(self, path: str, pixels: NDArray[np.uint8] | None) -> None:
        texture = None
        if pixels is not None:
            texture = self._ctx.texture(pixels.shape[1::-1], 3, np.ascontiguousarray(pixels), alignment=1)
            texture.repeat_x = texture.repeat_y = False
        self._textures[path] = texture
        if len(self._textures) > MAX_THUMBNAILS:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        texture = self._textures.pop(next(iter(self._textures)))
        if texture is not None:
            texture.release()


def _read(paths: tuple[str, ...], post: Post[ThumbnailRead]) -> None:
    from iibr_core.exports.photo_folder import middle_picture
    from iibr_core.formats.images.photo import read_thumbnail

    for path in paths:
        pixels = None
        with suppress(Exception):  # opening the photo shows what is wrong with it
            pixels = read_thumbnail(middle_picture(Path(path)), MAX_SIZE)
        post((path, pixels))
