"""Pictures of any size with all their samples, drawn in steps beside what the screen shows."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Generator
from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes.rect import Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ColorSpace
from viewer.gpu.context import GLContext
from viewer.gpu.programs import ProgramCache
from viewer.gpu.refocus.passes import Passes, ProgressiveAccumulation
from viewer.gpu.render_targets import PictureTargets

STEP_S = 0.005
"""Time of a step in seconds; a drag waits for one step at most."""

MAX_OPEN_TILE_PX = 1024
"""The same limit for an open lens, whose targets take more, and have a margin."""
MAX_TILE_PX = 2048
"""Largest side of a tile in pixels; its targets take at most 32 bytes a pixel."""

Pixels = NDArray[np.uint8 | np.float32]


@dataclass(frozen=True)
class PictureTile:
    """A part of a picture, drawn at once. window: the part as a share of the picture. rows, columns: its pixels."""

    window: Rect
    rows: slice
    columns: slice

    @property
    def size_px(self) -> ScreenSize:
        """Width and height."""
        return ScreenSize(self.columns.stop - self.columns.start, self.rows.stop - self.rows.start)


def picture_tiles(size_px: ScreenSize, max_px: int) -> list[PictureTile]:
    """Return tiles that together are the whole picture, at most max_px wide and high. size_px: (width, height)."""
    width, height = size_px
    side, tiles = min(MAX_TILE_PX, max_px), []
    for top, left in itertools.product(range(0, height, side), range(0, width, side)):
        rows, columns = min(side, height - top), min(side, width - left)
        window = Rect(left / width, top / height, columns / width, rows / height)
        tiles.append(PictureTile(window, slice(top, top + rows), slice(left, left + columns)))
    return tiles


class PictureDrawing:
    """Draws a picture tile by tile into targets of its own. Call it only from the thread of its context.

    image: (height, width, 3), float32 linear light, unclipped, or uint8, encoded by sRGB's curve; complete once
    `is_done`.
    """

    def __init__(
        self,
        gl: GLContext,
        programs: ProgramCache,
        whole: ProgressiveAccumulation,
        is_linear: bool,
        color_space: ColorSpace,
    ) -> None:
        """Prepare the drawing.

        whole: the picture, not begun. Its field is shared until `stop`; views that it gets later are not drawn.
        is_linear, color_space: see `RenderSettings`.
        """
        width, height = whole.size_px
        self.image: Pixels = np.empty((height, width, 3), np.float32 if is_linear else np.uint8)
        self.is_done = self._is_released = self._is_in_steps = False
        self._gl = gl
        self._passes = Passes(gl.ctx, programs)
        self._whole = replace(whole, field=whole.field.share())
        self._is_linear, self._color_space = is_linear, color_space
        max_px = MAX_OPEN_TILE_PX if whole.lens.slices else gl.max_texture_size
        self._tiles = picture_tiles(whole.size_px, min(max_px, gl.max_texture_size))
        self._tiles_done = 0
        self._current: ProgressiveAccumulation | None = None
        self._steps = self._draw()

    @property
    def progress(self) -> float:
        """Drawn share, 0..1."""
        passes = self._whole.passes
        passes_done = 0 if self._current is None else self._current.pass_index
        return (self._tiles_done * passes + passes_done) / (len(self._tiles) * passes)

    def advance(self, budget_s: float = math.inf) -> None:
        """Draw for about that long, at least a step; all of it without a budget."""
        self._is_in_steps = budget_s < math.inf
        end = time.perf_counter() + budget_s
        for _ in self._steps:
            if self._is_in_steps:
                self._gl.ctx.finish()
                if time.perf_counter() >= end:
                    return

    def steps(self) -> Generator[float]:
        """Draw a step at a time and yield the drawn share; at the end, or when closed, free every GL object."""
        try:
            while not self.is_done:
                self.advance(budget_s=0.0)
                yield self.progress
        finally:
            self.stop()

    def stop(self) -> None:
        """Free every GL object; the image stays. To be called in any case."""
        if not self._is_released:
            self._is_released = True
            self._steps.close()
            self._passes.release()
            self._whole.field.release()

    def _draw(self) -> Generator[None]:
        for tile in self._tiles:
            with ExitStack() as stack:
                yield from self._draw_tile(tile, stack)
            self._tiles_done, self._current = self._tiles_done + 1, None
            yield
        self.is_done = True

    def _draw_tile(self, tile: PictureTile, stack: ExitStack) -> Generator[None]:
        """Draw a tile. stack: frees its targets."""
        targets = PictureTargets(self._gl.ctx, tile.size_px, "f4" if self._is_linear else "f1")
        stack.callback(targets.release)
        lens = replace(self._whole.lens, part=self._whole.lens.part.part(tile.window))
        self._current = accumulation = replace(self._whole, lens=lens, size_px=tile.size_px)
        pixels = STEP_S / self._gl.seconds_per_fetch if self._is_in_steps else math.inf
        if lens.slices:
            pinhole = PictureTargets(self._gl.ctx, accumulation.drawn_px, "f4")
            stack.callback(pinhole.release)
            yield from self._passes.sum_up_in_steps(accumulation, pinhole.light.framebuffer, pixels)
            yield from self._passes.open_lens(accumulation, pinhole, targets.light.framebuffer)
        else:
            yield from self._passes.sum_up_in_steps(accumulation, targets.light.framebuffer, pixels)
        self._passes.present(lens, targets, self._is_linear, self._color_space)
        yield
        self.image[tile.rows, tile.columns] = targets.image.read()
