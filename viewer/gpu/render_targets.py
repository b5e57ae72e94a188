"""Images that passes draw into. Row 0 comes first in all but the picture for the screen."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes.screen_size import ScreenSize

KEPT_SIZES = 2
"""Number of picture sizes whose targets are kept: a picture drawn quickly is smaller than the next."""


def clear(framebuffer: Any) -> None:
    """Clear all of a framebuffer; without this, the part of the one that was bound before is the limit."""
    framebuffer.scissor = None
    framebuffer.use()
    framebuffer.clear()


class RenderTarget:
    """An RGBA texture of a size and its framebuffer. dtype: "f1" for bytes, "f4" for floats."""

    def __init__(self, ctx: moderngl.Context, size_px: ScreenSize, dtype: str) -> None:
        self._ctx, self._dtype = ctx, dtype
        self.size_px = ScreenSize(*size_px)
        self.texture = ctx.texture(size_px, 4, dtype=dtype)
        self.texture.repeat_x = self.texture.repeat_y = False
        self.framebuffer = ctx.framebuffer([self.texture])

    def read(self) -> NDArray[Any]:
        """Return the colours of a picture drawn bottom-up, (H, W, 3), bytes or floats, row 0 at the top."""
        raw = self.framebuffer.read(components=3, alignment=1, dtype=self._dtype)
        pixels = np.frombuffer(raw, np.uint8 if self._dtype == "f1" else np.float32)
        return pixels.reshape(self.size_px.height, self.size_px.width, 3)[::-1].copy()

    def release(self) -> None:
        """Free framebuffer and texture. Afterwards the screen is bound: moderngl binds the last framebuffer again."""
        self._ctx.detect_framebuffer(0).use()
        self.framebuffer.release()
        self.texture.release()


def sized(ctx: moderngl.Context, target: RenderTarget | None, size_px: ScreenSize) -> RenderTarget:
    """Return a target of bytes of this size: the same one if it has the size, else another in its place."""
    if target is not None and target.size_px == size_px:
        return target
    if target is not None:
        target.release()
    return RenderTarget(ctx, size_px, "f1")


class PictureTargets:
    """The targets of a picture. light: sum of light, weighted by alpha. image: finished picture, rows bottom-up; of a
    pinhole's picture, which an open lens blurs, the disparity that it sees.
    """

    def __init__(self, ctx: moderngl.Context, size_px: ScreenSize, dtype: str = "f1") -> None:
        """dtype: of the image, see `RenderTarget`."""
        self.size_px = ScreenSize(*size_px)
        self.image = RenderTarget(ctx, size_px, dtype)
        self.light = RenderTarget(ctx, size_px, "f4")

    def release(self) -> None:
        """Free both."""
        self.image.release()
        self.light.release()


class TargetCache:
    """Targets of the last sizes. shown: the targets whose image is on the screen, None before the first picture."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._targets: dict[ScreenSize, PictureTargets] = {}
        self.shown: PictureTargets | None = None

    def get(self, size_px: ScreenSize) -> PictureTargets:
        """Return the targets of this size; those of the size used longest ago are freed."""
        targets = self._targets.pop(size_px, None) or PictureTargets(self._ctx, size_px)
        while len(self._targets) >= KEPT_SIZES:
            self._forget_oldest()
        self._targets[size_px] = targets
        return targets

    def release(self) -> None:
        """Free every GL object."""
        while self._targets:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        oldest = self._targets.pop(next(iter(self._targets)))
        self.shown = None if self.shown is oldest else self.shown
        oldest.release()
