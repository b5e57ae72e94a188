"""The picture as it stands on the screen, and what the next one is drawn into meanwhile."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes.screen_size import ScreenSize
from viewer.gpu.render_targets import RenderTargets

KEPT_SIZES = 2
"""Of the picture: one drawn in a hurry is smaller than the one that follows it."""


class ScreenImage:
    """Render targets of the sizes asked for last; the image of one of them is shown."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._targets: dict[ScreenSize, RenderTargets] = {}
        self._shown: RenderTargets | None = None

    def targets_of(self, size_px: ScreenSize) -> RenderTargets:
        """Those of this size; beside them only the ones that were asked for last are kept."""
        targets = self._targets.pop(size_px, None) or RenderTargets(self._ctx, size_px)
        while len(self._targets) >= KEPT_SIZES:
            oldest = self._targets.pop(next(iter(self._targets)))
            self._shown = None if self._shown is oldest else self._shown
            oldest.release()
        self._targets[size_px] = targets
        return targets

    def show(self, targets: RenderTargets) -> None:
        """From now on the image of these is shown."""
        self._shown = targets

    @property
    def shown(self) -> RenderTargets:
        """What is shown. Something must have been drawn."""
        assert self._shown is not None, "render first"
        return self._shown

    def read(self) -> NDArray[np.uint8]:
        """What is shown, (H, W, 3), sRGB-encoded, row 0 at the top, as large as it was drawn."""
        return self.shown.image.read(np.uint8)

    def read_pixel(self, u: float, v: float) -> tuple[int, int, int]:
        """What is shown at texture coordinates (0..1, row 0 at the top), sRGB bytes."""
        framebuffer = self.shown.image.framebuffer
        x, y = (min(max(int(at * size), 0), size - 1) for at, size in zip((u, 1 - v), framebuffer.size))
        red, green, blue = framebuffer.read((x, y, 1, 1), components=3, alignment=1)
        return red, green, blue

    def release(self) -> None:
        """Free every GL object."""
        for targets in self._targets.values():
            targets.release()
        self._targets.clear()
        self._shown = None
