"""The picture that the screen shows, and targets of the next picture."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes.screen_size import ScreenSize
from viewer.gpu.render_targets import PictureTargets

KEPT_SIZES = 2
"""Number of picture sizes whose targets are kept: a picture drawn quickly is smaller than the next."""


class ScreenImage:
    """Targets of the last sizes; the image of one of them is shown."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._targets: dict[ScreenSize, PictureTargets] = {}
        self._shown: PictureTargets | None = None

    def targets_of(self, size_px: ScreenSize) -> PictureTargets:
        """Return the targets of this size; those of the size used longest ago are freed."""
        targets = self._targets.pop(size_px, None) or PictureTargets(self._ctx, size_px)
        while len(self._targets) >= KEPT_SIZES:
            oldest = self._targets.pop(next(iter(self._targets)))
            self._shown = None if self._shown is oldest else self._shown
            oldest.release()
        self._targets[size_px] = targets
        return targets

    @property
    def shown(self) -> PictureTargets:
        """The targets whose image is shown; set them once a picture is drawn."""
        assert self._shown is not None, "render first"
        return self._shown

    @shown.setter
    def shown(self, targets: PictureTargets) -> None:
        self._shown = targets

    def read(self) -> NDArray[np.uint8]:
        """Return the picture at the size at which it was drawn, (H, W, 3), sRGB-encoded, row 0 at the top."""
        return self.shown.image.read()

    def read_pixel(self, u: float, v: float) -> tuple[int, int, int]:
        """Return the colour at texture coordinates (0..1, row 0 at the top), sRGB bytes."""
        x, y = (min(max(int(at * size), 0), size - 1) for at, size in zip((u, 1 - v), self.shown.size_px))
        red, green, blue = self.shown.image.framebuffer.read((x, y, 1, 1), components=3, alignment=1)
        return red, green, blue

    def release(self) -> None:
        """Free every GL object."""
        for targets in self._targets.values():
            targets.release()
        self._targets.clear()
        self._shown = None
