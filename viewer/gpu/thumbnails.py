"""Thumbnails on the graphics card, a texture each."""

from __future__ import annotations

from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

MAX_THUMBNAILS = 224
"""Number of thumbnails that are kept."""


class ThumbnailTexture(NamedTuple):
    """A thumbnail: the GL name of its texture and its width / height."""

    name: int
    aspect: float


class ThumbnailTextures:
    """Keeps the thumbnails that were asked for last."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._textures: dict[str, moderngl.Texture] = {}

    def put(self, name: str, pixels: NDArray[np.uint8]) -> None:
        """Keep a picture (h, w, 3), rows top-down, by this name."""
        height, width = pixels.shape[:2]
        texture = self._ctx.texture((width, height), 3, np.ascontiguousarray(pixels), alignment=1)
        texture.repeat_x = texture.repeat_y = False
        self._textures[name] = texture
        if len(self._textures) > MAX_THUMBNAILS:
            self._textures.pop(next(iter(self._textures))).release()

    def get(self, name: str) -> ThumbnailTexture | None:
        """Return the thumbnail of this name, None if it is not kept."""
        texture = self._textures.pop(name, None)
        if texture is None:
            return None
        self._textures[name] = texture  # asked for last
        return ThumbnailTexture(texture.glo, texture.width / texture.height)

    def release(self) -> None:
        """Free every texture."""
        for texture in self._textures.values():
            texture.release()
        self._textures.clear()
