"""Quality levels for interactive frames, chosen by measured cost. Plain numbers, no GL.

Costs are counted in fetches of a texel; the time of a fetch is measured while drawing.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.beyond.picture_quality import QUALITY_LEVELS, QualityLevel
from iibr_core.scenes.screen_size import ScreenSize

PICTURE_FETCHES = 4.0
"""Cost of a pixel without any camera."""
COLOR_FETCHES, WARP_FETCHES = 3.0, 2.0
"""Cost of a camera's colour at a pixel, and of finding the surface that it sees."""
OPEN_FETCHES = 120.0
"""Cost of a pixel of a picture through an open lens, beside that of the pinhole's picture."""
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


def fetches_of(samples: int, pixels: int, warps: bool) -> float:
    """Return the cost of a picture in fetches. samples: number of cameras, of a pinhole: of views."""
    return pixels * (PICTURE_FETCHES + samples * (COLOR_FETCHES + WARP_FETCHES * warps))


class FrameTimeModel:
    """Measured speed of this machine. seconds_per_fetch: a first guess."""

    def __init__(self, seconds_per_fetch: float) -> None:
        self._seconds_per_fetch, self._is_measured = UNMEASURED * seconds_per_fetch, False

    def seconds(self, fetches: float) -> float:
        """Return the expected time."""
        return OVERHEAD_S + self._seconds_per_fetch * fetches

    def learn(self, fetches: float, seconds: float) -> None:
        """Take a measured time into account."""
        latest = max(seconds - OVERHEAD_S, 0.2 * seconds) / fetches
        self._seconds_per_fetch += (NEW_SHARE if self._is_measured else 1.0) * (latest - self._seconds_per_fetch)
        self._is_measured = True


def choose_quality_level(
    fetches: Callable[[QualityLevel], float], frame_time: FrameTimeModel, budget_s: float, before: int
) -> int:
    """Return the index of the best of QUALITY_LEVELS for which there is time, or of the last.

    before: index for the picture before; a better level needs time to spare.
    """
    for index, level in enumerate(QUALITY_LEVELS):
        if frame_time.seconds(fetches(level)) <= budget_s * (BETTER_ONLY_WITHIN if index < before else 1.0):
            return index
    return len(QUALITY_LEVELS) - 1
