"""How much smaller an opening has to be taken, so that its samples blur like the opening itself. Plain arrays, no GL.

Few samples are wider than what they stand for: by their soft edges, and by the smoothing between them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering import ApertureShape, opening, openness

LEAST_SCALE = 0.4
"""An opening still smaller would leave next to no sample."""

FINE = 48
"""Points across the opening that tell its own second moment."""

TRIES, TOLERANCE = 30, 1e-3
"""Of the search for the scale, and how near the second moment has to come."""


@lru_cache(maxsize=64)
def scale_of(
    shape: ApertureShape,
    place: tuple[float, float],
    diameter: float,
    widest: float,
    stride: int,
    is_smoothed: bool,
) -> float:
    """Factor, LEAST_SCALE..1, for the opening and the square that cuts it off.

    With it the drawn light has the second moment of the opening: that of the samples, and of a box as wide as `stride`
    if is_smoothed. place: (t, s) of a sample from the eye, view steps. diameter, widest: of the opening and the square,
    view steps. Below 2 view steps the pinhole view has its share of the picture, and no width.
    """
    # With a cat's-eye, what passes in the picture's middle counts: there the barrel's soft edge lies on the opening's.
    t, s = np.meshgrid(*(_lattice(start, min(diameter, widest), stride) for start in place), indexing="ij")
    # Variances add: the box of the smoothing takes width^2 / 12 of the opening's own.
    width = min(float(stride), diameter)
    own = diameter**2 * _own_second_moment(shape, min(widest / diameter, 1.0))
    wanted = max(own - is_smoothed * width**2 / 12, 0.0) / min(max(diameter - 1.0, 1e-3), 1.0)
    barrel = opening(ApertureShape(), t, s, diameter, width) if shape.kind == "cat_eye" else 1.0

    def too_wide(scale: float) -> float:
        weights = openness(shape, t, s, scale * diameter, scale * widest, width)
        return second_moment(barrel * weights, t, s) - wanted

    return _root(too_wide, LEAST_SCALE, 1.0, TOLERANCE * own)


def second_moment(weights: NDArray[np.float64], t: NDArray[np.float64], s: NDArray[np.float64]) -> float:
    """Per axis, mean of both, about (0, 0); 0 where nothing passes. A disc's is radius^2 / 4."""
    total = float(weights.sum())
    return float((weights * (t**2 + s**2)).sum()) / total / 2 if total > 0 else 0.0


@lru_cache(maxsize=64)
def _own_second_moment(shape: ApertureShape, widest: float) -> float:
    """Of the opening itself, for a diameter of 1. widest: side of the square that cuts it off, at most 1."""
    places = widest * ((np.arange(FINE) + 0.5) / FINE - 0.5)
    t, s = np.meshgrid(places, places, indexing="ij")
    return second_moment(openness(shape, t, s, 1.0, widest, widest / FINE), t, s)


def _lattice(start: float, extent: float, stride: int) -> NDArray[np.float64]:
    """All places around 0 where a sample may be open: a triangle's soft corners reach a stride beyond it."""
    most = int(extent / 2 / stride) + 2
    return start + stride * np.arange(-most, most + 1, dtype=float)


def _root(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Where an increasing function is 0; the end that comes nearest where it is nowhere (regula falsi, Illinois)."""
    at_low, at_high = function(low), function(high)
    if at_high <= 0 or at_low >= 0:
        return high if at_high <= 0 else low
    middle, side = low, 0
    for _ in range(TRIES):
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        value = function(middle)
        if abs(value) <= tolerance:
            break
        if value > 0:
            # The end that stays twice counts half: else regula falsi creeps.
            high, at_high, at_low = middle, value, at_low / (2 if side > 0 else 1)
            side = 1
        else:
            low, at_low, at_high = middle, value, at_high / (2 if side < 0 else 1)
            side = -1
    return middle
