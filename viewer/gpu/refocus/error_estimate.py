"""How far a picture is from the converged one, told from how much it still changes. Plain arrays, no GL.

The mean of 2n independent samples differs from that of the first n by about as much as it differs from the truth.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from numpy.typing import NDArray


class ErrorEstimate:
    """Of the picture that is being refined, and of hurried ones by what refining them showed last time."""

    def __init__(self) -> None:
        self.estimate: float | None = None
        self._level: Hashable = None
        self._hurried: NDArray[np.uint8] | None = None
        self._latest: NDArray[np.uint8] | None = None
        self._by_level: dict[Hashable, float] = {}

    def begin(self, level: Hashable) -> None:
        """A picture was drawn at this level."""
        self._level, self._hurried, self._latest = level, None, None
        self.estimate = self._by_level.get(level)

    @property
    def is_new(self) -> bool:
        """Whether nothing is known of the picture drawn last."""
        return self._hurried is None

    def add(self, image: NDArray[np.uint8], passes: int) -> None:
        """The picture (H, W, 3) after so many passes of samples, each time about twice as many; 0 = the hurried one."""
        if passes == 0 or self._hurried is None or self._latest is None:
            self._hurried = self._latest = image
            return
        self.estimate = rms_difference(image, self._latest)
        self._latest = image
        self._by_level[self._level] = rms_difference(image, self._hurried)


def rms_difference(image: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Root mean square difference, 1 = white."""
    return float(np.sqrt(np.mean((image.astype(np.float32) - other) ** 2)) / 255)
