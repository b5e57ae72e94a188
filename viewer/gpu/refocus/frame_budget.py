"""What a picture drawn in a hurry leaves out, and how much of that the time allows. Plain numbers, no GL.

Costs are counted in fetches of a texel; how long one takes is measured while drawing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes.screen_size import ScreenSize
from viewer.gpu.refocus.view_sampling import MAX_SOURCES


@dataclass(frozen=True)
class QualityLevel:
    """What is left out.

    cameras: share of a pass's cameras in the aperture. sources: stored views that answer a pinhole, at most.
    scale: of the picture's width and height.
    """

    cameras: float = 1.0
    sources: int = MAX_SOURCES
    scale: float = 1.0


BEST_QUALITY = QualityLevel()
QUALITY_LEVELS = (
    BEST_QUALITY,
    QualityLevel(1.0, 2),
    QualityLevel(1.0, 1),
    QualityLevel(1.0, 1, 0.7),
    QualityLevel(1.0, 1, 0.5),
    QualityLevel(1.0, 1, 0.35),
    QualityLevel(0.5, 1, 0.35),
)
"""From the best picture to the quickest. At equal cost, half the width is nearer to the settled picture than a quarter
of the cameras.
"""

PICTURE_FETCHES = 4.0
COLOR_FETCHES, WARP_FETCHES = 3.0, 2.0
"""Cost of interpolating a camera's colour, and of finding the surface that it sees."""
UNMEASURED = 2.0
"""Factor on the guess for work that was not drawn yet: the first frame of a drag must not stall."""
OVERHEAD_S = 0.003
"""What a picture takes however small it is."""

BETTER_ONLY_WITHIN = 0.85
"""Of the time: a picture near the limit would else change back and forth."""

LATEST_COUNTS = 0.4
"""How much the latest measurement counts against those before."""


def scale_size(size_px: ScreenSize, scale: float) -> ScreenSize:
    """That size times scale, at least one pixel."""
    width, height = size_px
    return ScreenSize(max(round(width * scale), 1), max(round(height * scale), 1))


def stretch_image(image: NDArray[np.uint8], size_px: ScreenSize) -> NDArray[np.uint8]:
    """A picture (H, W, 3) drawn smaller, at (width, height): interpolated linearly, as the screen shows it."""
    rows, columns = (_taps(there, here) for there, here in zip(size_px[::-1], image.shape))
    light = image.astype(np.float32)
    light = light[rows[0]] + rows[2][:, None, None] * (light[rows[1]] - light[rows[0]])
    light = light[:, columns[0]] + columns[2][:, None] * (light[:, columns[1]] - light[:, columns[0]])
    return np.rint(light).astype(np.uint8)


def _taps(there: int, here: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    """For each pixel asked for: the two beside its place here, and how much the second counts."""
    places = np.clip((np.arange(there) + 0.5) * (here / there) - 0.5, 0, here - 1)
    low = places.astype(np.intp)
    return low, np.minimum(low + 1, here - 1), (places - low).astype(np.float32)


@dataclass(frozen=True)
class DrawCost:
    """Cost of drawing a picture.

    samples: cameras; of a pinhole, views that answer it. warps: whether views are warped by their disparity. pixels:
    size of the picture as drawn.
    """

    samples: int
    warps: bool
    pixels: int

    @property
    def fetches(self) -> float:
        """How many fetches of a texel it costs, about."""
        of_sample = COLOR_FETCHES + WARP_FETCHES * self.warps
        return self.pixels * (PICTURE_FETCHES + self.samples * of_sample)

    @property
    def kind(self) -> tuple[bool, ...]:
        """What sorts of work there are: the estimate of each is off in its own way."""
        return (self.warps,)


class FrameTimeModel:
    """How fast this machine draws. seconds_per_fetch: a first guess."""

    def __init__(self, seconds_per_fetch: float) -> None:
        self._guess = seconds_per_fetch
        self._measured: dict[tuple[bool, ...], float] = {}

    def seconds(self, work: DrawCost) -> float:
        """How long it will take, about."""
        return OVERHEAD_S + self._measured.get(work.kind, self._unmeasured) * work.fetches

    @property
    def _unmeasured(self) -> float:
        """Seconds per fetch of work of a sort that was not drawn yet: no less than of any that was."""
        return max(UNMEASURED * self._guess, *self._measured.values(), 0.0)

    def learn(self, work: DrawCost, seconds: float) -> None:
        """Take note of how long it took."""
        before = self._measured.get(work.kind)
        latest = max(seconds - OVERHEAD_S, 0.2 * seconds) / work.fetches
        self._measured[work.kind] = latest if before is None else before + LATEST_COUNTS * (latest - before)


def choose_quality_level(
    work_in: Callable[[QualityLevel], DrawCost], frame_time: FrameTimeModel, budget_s: float, before: int
) -> int:
    """Which of QUALITY_LEVELS there is time for, as an index: the first, else the last. work_in: what each takes.

    before: the one of the picture before; a better one is taken up only with time to spare.
    """
    for index, level in enumerate(QUALITY_LEVELS):
        if frame_time.seconds(work_in(level)) <= budget_s * (BETTER_ONLY_WITHIN if index < before else 1.0):
            return index
    return len(QUALITY_LEVELS) - 1
