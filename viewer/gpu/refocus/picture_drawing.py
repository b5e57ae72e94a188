"""A picture of any size with every sample it will get, drawn a step at a time beside what the screen shows."""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import ColorSpace, ViewUpdate
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.accumulation import Accumulator, ProgressiveAccumulation
from viewer.gpu.refocus.picture_tiling import PictureTile, picture_tiles
from viewer.gpu.render_targets import RenderTarget, RenderTargets, unbind

STEP_S = 0.005
"""What a step is meant to take: a hand that drags waits for no more than one of them."""

Pixels = NDArray[np.uint8 | np.float32]


class PictureDrawing:
    """Draws a picture tile by tile into targets of its own. Call it only from the thread its context belongs to.

    image: (height, width, 3), whole once `is_done`: float32 linear light, not cut off at white or 0, or uint8, encoded
    by sRGB's curve.
    is_stopped: by `stop`, before it was whole; the image then stays unfinished.
    """

    def __init__(
        self,
        gl: GLContext,
        accumulator: Accumulator,
        field: LightFieldTexture,
        whole: ProgressiveAccumulation,
        is_linear: bool,
        color_space: ColorSpace,
        views: Sequence[ViewUpdate] = (),
    ) -> None:
        """Draw nothing yet. accumulator: its own, released with it. whole: the picture, not begun.

        is_linear, color_space: see `RenderSettings`. field: held until `stop`, so that another may take its place on
        the screen. Views that it gets from now on are not seen: all tiles show the same. views: those that this picture
        alone shows, uploaded first, a view a step.
        """
        width, height = whole.size_px
        self.image: Pixels = np.empty((height, width, 3), np.float32 if is_linear else np.uint8)
        self.is_done = self.is_stopped = self._is_released = False
        self._gl = gl
        self._accumulator = accumulator
        self._field = field.share()
        self._whole, self._views = whole, views
        self._is_linear = is_linear
        self._color_space = color_space
        self._tiles = picture_tiles(whole.size_px, gl.max_texture_size)
        self._tiles_done = 0
        self._under_way: ProgressiveAccumulation | None = None
        self._is_in_steps = False
        self._steps = self._draw()

    @property
    def progress(self) -> float:
        """How much of it is drawn, 0..1."""
        passes = self._whole.passes
        begun = self._under_way.pass_index if self._under_way is not None else 0
        return (self._tiles_done * passes + begun) / (len(self._tiles) * passes)

    def advance(self, budget_s: float = math.inf) -> None:
        """Draw on for about that long, at least a step; all of it without a budget."""
        self._is_in_steps = budget_s < math.inf
        end = time.perf_counter() + budget_s
        for _ in self._steps:
            if self._is_in_steps:
                self._gl.ctx.finish()
                if time.perf_counter() >= end:
                    return

    def stop(self) -> None:
        """Draw no more, and free every GL object; the image stays. To be called even where it is done."""
        if self._is_released:
            return
        self._is_released, self.is_stopped = True, not self.is_done
        self._steps.close()
        self._accumulator.release()
        self._field.release()

    def _draw(self) -> Generator[None]:
        for view in self._views:
            self._field.upload(view.row, view.column, view.colors, view.disparity)
            yield
        for tile in self._tiles:
            target = RenderTarget(
                self._gl.ctx, [self._gl.ctx.texture(tile.size_px, 4, dtype="f4" if self._is_linear else "f1")]
            )
            targets = RenderTargets(self._gl.ctx, tile.size_px)
            try:
                yield from self._draw_tile(tile, targets, target)
            finally:
                unbind(self._gl.ctx)
                target.release()
                targets.release()
            self._tiles_done, self._under_way = self._tiles_done + 1, None
            yield
        self.is_done = True

    def _draw_tile(self, tile: PictureTile, targets: RenderTargets, target: RenderTarget) -> Generator[None]:
        lens = replace(self._whole.lens, part=self._whole.lens.part.part(tile.window))
        self._under_way = accumulation = replace(self._whole, lens=lens, size_px=tile.size_px)
        pixels = STEP_S / self._gl.seconds_per_fetch if self._is_in_steps else math.inf
        yield from self._accumulator.sum_up_in_steps(self._field, accumulation, targets, pixels)
        self._accumulator.finish(accumulation, targets, target.framebuffer, self._is_linear, self._color_space)
        yield
        drawn = target.read(np.float32 if self._is_linear else np.uint8)
        self.image[tile.rows, tile.columns] = drawn
