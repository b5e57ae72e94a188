"""Small pictures in one texture: the filmstrip draws them all with it."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.types import ImageSize
from viewer.model.state.folder import Thumbnail

CELL = ImageSize(height=96, width=144)
ACROSS, DOWN = 14, 16


class ThumbnailTexture:
    """Keeps as many small pictures as there are cells; the one that was asked for longest ago goes first."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._texture = ctx.texture((ACROSS * CELL.width, DOWN * CELL.height), 3, alignment=1)
        self._texture.filter = moderngl.LINEAR, moderngl.LINEAR
        self._free = list(range(ACROSS * DOWN))
        self._cells: dict[str, tuple[int, Thumbnail]] = {}

    def put(self, name: str, pixels: NDArray[np.uint8]) -> None:
        """Keep a picture (h, w, 3) no larger than a cell, rows top-down, by this name."""
        height, width = pixels.shape[:2]
        cell = self._cells.pop(name)[0] if name in self._cells else self._free_cell()
        x, y = cell % ACROSS * CELL.width, cell // ACROSS * CELL.height
        self._texture.write(np.ascontiguousarray(pixels), (x, y, width, height), alignment=1)
        whole = ACROSS * CELL.width, DOWN * CELL.height
        # Half a pixel inside, where no neighbour shines in.
        low = (x + 0.5) / whole[0], (y + 0.5) / whole[1]
        high = (x + width - 0.5) / whole[0], (y + height - 0.5) / whole[1]
        self._cells[name] = cell, Thumbnail(self._texture.glo, low, high, width / height)

    def get(self, name: str) -> Thumbnail | None:
        """The picture of this name, None where it is not there."""
        if name not in self._cells:
            return None
        self._cells[name] = self._cells.pop(name)  # asked for last
        return self._cells[name][1]

    def release(self) -> None:
        """Free the texture."""
        self._texture.release()

    def _free_cell(self) -> int:
        return self._free.pop() if self._free else self._cells.pop(next(iter(self._cells)))[0]
