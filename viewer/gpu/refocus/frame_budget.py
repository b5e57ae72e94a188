"""Quality levels for interactive frames, chosen by measured cost. Plain numbers, no GL.

Costs are counted in fetches of a texel; the time of a fetch is measured while drawing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.beyond.picture_quality import QUALITY_LEVELS, QualityLevel
from iibr_core.scenes.screen_size import ScreenSize

PICTURE_FETCHES = 4.0
"""Cost of a pixel without any camera."""
COLOR_FETCHES, WARP_FETCHES = 3.0, 2.0
"""Cost of a camera's colour at a pixel, and of finding the surface that it sees."""
UNMEASURED = 2.0
"""Factor on the guess for work that was not drawn yet: the first frame of a drag must not stall."""
OVERHEAD_S = 0.003
"""Time of a picture without pixels."""
BETTER_ONLY_WITHIN = 0.85
"""Share of the time that a better level may take; otherwise a picture near the limit changes back and forth."""
NEW_SHARE = 0.4
"""Weight of a new measurement against earlier ones."""


def scale_size(size_px: ScreenSize, scale: float) -> ScreenSize:
    """Return the size times scale, at least one pixel."""
    width, height = size_px
    return ScreenSize(max(round(width * scale), 1), max(round(height * scale), 1))


def stretch_image(image: NDArray[np.uint8], size_px: ScreenSize) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) at (width, height), interpolated linearly as on the screen."""
    return np.asarray(Image.fromarray(image).resize(size_px, Image.Resampling.BILINEAR))


@dataclass(frozen=True)
class DrawCost:
    """Cost of a picture. samples: number of cameras, of a pinhole: of views. warps: whether views are warped."""

    samples: int
    warps: bool
    pixels: int

    @property
    def fetches(self) -> float:
        """Number of fetches of a texel."""
        return self.pixels * (PICTURE_FETCHES + self.samples * (COLOR_FETCHES + WARP_FETCHES * self.warps))


class FrameTimeModel:
    """Measured speed of this machine, with warps and without. seconds_per_fetch: a first guess."""

    def __init__(self, seconds_per_fetch: float) -> None:
        self._guess = seconds_per_fetch
        self._measured: dict[bool, float] = {}

    def seconds(self, cost: DrawCost) -> float:
        """Return the expected time. Work that was not drawn yet takes no less a fetch than other work."""
        unmeasured = max(UNMEASURED * self._guess, *self._measured.values(), 0.0)
        return OVERHEAD_S + self._measured.get(cost.warps, unmeasured) * cost.fetches

    def learn(self, cost: DrawCost, seconds: float) -> None:
        """Take a measured time into account."""
        before = self._measured.get(cost.warps)
        latest = max(seconds - OVERHEAD_S, 0.2 * seconds) / cost.fetches
        self._measured[cost.warps] = latest if before is None else before + NEW_SHARE * (latest - before)


def choose_quality_level(
    cost_of: Callable[[QualityLevel], DrawCost], frame_time: FrameTimeModel, budget_s: float, before: int
) -> int:
    """Return the index of the best of QUALITY_LEVELS for which there is time, or of the last.

    before: index for the picture before; a better level needs time to spare.
    """
    for index, level in enumerate(QUALITY_LEVELS):
        if frame_time.seconds(cost_of(level)) <= budget_s * (BETTER_ONLY_WITHIN if index < before else 1.0):
            return index
    return len(QUALITY_LEVELS) - 1
