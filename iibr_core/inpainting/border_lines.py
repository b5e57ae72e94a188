"""Which way lines run where they meet a hole: they go on straight (coherence transport, Bornemann & Maerz, 2007)."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.jit import kernel

LINE_REACH_PX = 5
"""Lines are told from 11 x 11 pixels."""
MIXED_PX = 2
"""Colours this close to a hole may be mixed with those of what hides it: their lines follow its outline."""
STRENGTH_POWER, ANGLE_POWER = 2, 16
"""Lines count by their strength, and by the cosine of the angle off them, to these powers."""
LINE_NOISE = 0.01
"""Steps between neighbouring pixels, standard deviation, that make no line."""


def mixed_beside(hole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The hole (H, W) and what is MIXED_PX from it at most, across, down or both."""
    tall = hole.copy()
    for k in range(1, MIXED_PX + 1):
        tall[k:] |= hole[:-k]
        tall[:-k] |= hole[k:]
    mixed = tall.copy()
    for k in range(1, MIXED_PX + 1):
        mixed[:, k:] |= tall[:, :-k]
        mixed[:, :-k] |= tall[:, k:]
    return mixed


@kernel
def find_lines(colors, disparity, pure, borders, one_surface, lines):
    """Write lines (M, 2) at the borders, flat indices (M,): (cos 2a, sin 2a), a the angle at which colours change the
    least; as long as they change across that line only, 0 where no way differs from others. Only a border's own surface
    counts: where the disparities `pure` (H, W), NaN for what is mixed, differ from the border's by one_surface at most.
    """
    height, width = disparity.shape
    for i in range(len(borders)):
        y, x = borders[i] // width, borders[i] % width
        d = disparity[y, x]
        left, right = max(x - LINE_REACH_PX, 0), min(x + LINE_REACH_PX + 1, width - 1)
        # The structure tensor, summed over colours, along the diagonals of 2 x 2 pixels: unlike steps to the right and
        # down, those are of one place.
        falls = both = rises = 0.0
        for v in range(max(y - LINE_REACH_PX, 0), min(y + LINE_REACH_PX + 1, height - 1)):
            is_own = abs(pure[v, left] - d) <= one_surface and abs(pure[v + 1, left] - d) <= one_surface
            for u in range(left, right):
                was_own = is_own
                is_own = abs(pure[v, u + 1] - d) <= one_surface and abs(pure[v + 1, u + 1] - d) <= one_surface
                if was_own and is_own:
                    for c in range(3):
                        # Squares of huge colours are beyond single precision.
                        falling = np.float64(colors[v + 1, u + 1, c] - colors[v, u, c])
                        rising = np.float64(colors[v, u + 1, c] - colors[v + 1, u, c])
                        falls += falling * falling
                        both += falling * rising
                        rises += rising * rising
        # Turned by 45 degrees, xx + yy = (falls + rises) / 2, yy - xx = -both, 4 xy = falls - rises. The eigenvalues
        # differ by sqrt((xx - yy)^2 + 4 xy^2); the line runs across the larger one's direction.
        total = 0.5 * (falls + rises) + 3 * (2 * LINE_REACH_PX + 1) ** 2 * LINE_NOISE**2
        lines[i, 0], lines[i, 1] = -both / total, 0.5 * (rises - falls) / total


@kernel
def line_weight(line_cos, line_sin, down, across):
    """How well the way (down, across) runs along one of those lines, 0 to 1."""
    strength = sqrt(line_cos * line_cos + line_sin * line_sin)
    if strength == 0.0:
        return 0.0
    # cos(2 angle), the angle between the line and the way.
    squared = float(down * down + across * across)
    double = (line_cos * (across * across - down * down) + line_sin * 2.0 * across * down) / (strength * squared)
    return strength**STRENGTH_POWER * max(0.5 + 0.5 * double, 0.0) ** (ANGLE_POWER // 2)
