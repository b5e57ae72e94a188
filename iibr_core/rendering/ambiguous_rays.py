"""Ambiguous rays: those of which the closed form leaves open which surface they show.

Either it covers them in part, or by several surfaces whose shares nothing tells, or a soft edge of the map lies near:
then it is sure of a surface that may be the wrong one. Of all others it is right, and T has no say.

For each of them K hypotheses are laid out: surfaces that land within a few pixels, as different from each other as
possible. A hypothesis says "this ray shows the source ray that disparity d leads to"; its features say how well that
agrees with the disparity that the source ray really has. This is what a trained T decides on; colours are never among
the features.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, ViewOffset

HYPOTHESES = 6
"""K: the paper's 5 surfaces and the plain look-up. More take time and gain little (docs/tables)."""
PLAIN = 128
"""Added to the source of the hypothesis that the ray shows the front-most surface as the photo mixed it at its edge."""
REACH_PX = 6
"""Surfaces that land within this many pixels, each way, are considered."""
LEAST_WEIGHT = 0.02
SHARE, INPAINTED, SOFTNESS, UNCOVERED = 6, 8, 11, 12
"""Features: the closed form's weight, whether inpainted, the map's softness, the share that nothing covers."""
PROFILE = 15
PROFILE_PX = (-4.0, -2.5, -1.0, 1.0, 2.5, 4.0)
"""Where the disparity around a source ray is sampled, along the parallax and across it."""
FEATURES = PROFILE + 2 * len(PROFILE_PX) + 1
"""The last is 0: a multiple of four suits the arithmetic."""


@dataclass(frozen=True, eq=False)
class AmbiguousRays:
    """Ambiguous rays (N) of one view and their hypotheses (K).

    offset: of the view. pixel (N, 2): (row, column) in the view. mask (N, K): hypotheses in use, the first always.
    disparity (N, K). source (N, K). features (N, K, FEATURES).
    """

    offset: ViewOffset
    pixel: NDArray[np.int64]
    mask: NDArray[np.bool_]
    disparity: FloatImage
    source: NDArray[np.uint8]
    features: FloatImage


@dataclass(frozen=True, eq=False)
class UndecidedRays:
    """Ambiguous rays (N) of one view before T is asked, as small as they can wait for it.

    hypotheses: K. pixel (N): index into the view's pixels, row by row. number (N): hypotheses of each, at most K.
    uncovered (N): share of the ray that nothing covers. disparity, source, share, nearest: of all hypotheses, those of
    one ray after those of the other; share is the closed form's weight, nearest how many pixels away its surface lands.
    """

    offset: ViewOffset
    hypotheses: int
    pixel: NDArray[np.int32]
    number: NDArray[np.uint8]
    uncovered: FloatImage
    disparity: FloatImage
    source: NDArray[np.uint8]
    share: FloatImage
    nearest: FloatImage

    @property
    def nbytes(self) -> int:
        """Memory they take."""
        return sum(part.nbytes for part in vars(self).values() if isinstance(part, np.ndarray))
