"""Makes exact disparity as wrong as real maps are: soft edges, noise, coarse steps, few pixels, shifts, a wrong scale.

Every function takes and gives (H, W) float32 in px per view step and leaves its input alone.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, exp
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.training.distributions import log_uniform
from iibr_core.types import FloatImage

KERNEL_SIGMAS = 3.5
MOST_FAULTS = 3
UNTOUCHED = 0.4
"""Share of maps that `degrade` leaves exact, as rendered scenes have them: T must not spoil good maps."""


def blur(disparity: FloatImage, sigma_px: float) -> FloatImage:
    """Convolved with a Gaussian; the frame's pixels continue beyond it. sigma_px 0 changes nothing.

    scipy's gives the same bits, and training does without it.
    """
    if sigma_px <= 0:
        return disparity.copy()
    reach = max(ceil(KERNEL_SIGMAS * sigma_px), 1)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma_px) ** 2)
    taps /= taps.sum()
    soft = disparity.astype(np.float64)
    for axis in (0, 1):
        padded = np.pad(soft, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, len(taps), axis)
        soft = windows @ taps
    return soft.astype(np.float32)


def add_noise(disparity: FloatImage, rng: np.random.Generator, strength: float, grain_px: float = 0.0) -> FloatImage:
    """With Gaussian noise of this standard deviation (px per view step), its grains grain_px (sigma) wide."""
    grains = blur(rng.standard_normal(disparity.shape).astype(np.float32), grain_px)
    spread = float(grains.std())
    return disparity + grains * np.float32(strength / spread if grain_px > 0 and spread > 0 else strength)


def quantise(disparity: FloatImage, step: float) -> FloatImage:
    """Rounded to multiples of a step (px per view step). A step of 0 changes nothing."""
    if step <= 0:
        return disparity.copy()
    return np.asarray(np.rint(disparity / step) * step, np.float32)


def coarsen(disparity: FloatImage, factor: int) -> FloatImage:
    """Averaged over squares of factor x factor pixels, then enlarged bilinearly."""
    if factor <= 1:
        return disparity.copy()
    out = disparity.astype(np.float64)
    for axis in (0, 1):
        starts = np.arange(0, out.shape[axis], factor)
        counts = np.diff(np.r_[starts, out.shape[axis]])
        means = np.moveaxis(np.add.reduceat(out, starts, axis=axis), axis, -1) / counts
        out = np.moveaxis(_interpolate(means, starts + (counts - 1) * 0.5, out.shape[axis]), -1, axis)
    return np.ascontiguousarray(out, np.float32)


def misalign(disparity: FloatImage, down_px: float, right_px: float) -> FloatImage:
    """Moved against the photo, with bilinear interpolation; the frame's pixels continue beyond it."""
    out = disparity.astype(np.float64)
    for axis, shift in ((0, down_px), (1, right_px)):
        moved = _interpolate(np.moveaxis(out, axis, -1), np.arange(out.shape[axis]) + shift, out.shape[axis])
        out = np.moveaxis(moved, -1, axis)
    return out.astype(np.float32)


def rescale(disparity: FloatImage, scale: float, shift: float) -> FloatImage:
    """Times scale, plus shift: what is left where scale and shift are estimated wrongly."""
    return (disparity * np.float32(scale) + np.float32(shift)).astype(np.float32)


def _interpolate(values: NDArray[np.float64], places: NDArray[Any], count: int) -> NDArray[np.float64]:
    """(..., count): values (..., N) that stand at increasing places (N,), read linearly at 0, 1, ..., count - 1."""
    last = len(places) - 1
    wanted = np.clip(np.arange(count), places[0], places[-1])
    left = np.clip(np.searchsorted(places, wanted, side="right") - 1, 0, max(last - 1, 0))
    right = np.minimum(left + 1, last)
    share = (wanted - places[left]) / np.where(right > left, places[right] - places[left], 1.0)
    return np.asarray(values[..., left] * (1 - share) + values[..., right] * share)


def degrade(disparity: FloatImage, rng: np.random.Generator, views: float = 1.0) -> FloatImage:
    """Some of the faults above at random strengths; a share of UNTOUCHED maps has none.

    views: the largest view offset that will be rendered; noise, steps and shift are a matter of pixels there, as an
    error of the disparity shows in proportion to it.
    """
    if rng.random() < UNTOUCHED:
        return disparity.copy()
    step = 1 / max(views, 1.0)
    faults: list[Callable[[FloatImage], FloatImage]] = [
        lambda d: coarsen(d, int(rng.integers(2, 5))),
        lambda d: blur(d, log_uniform(rng, 0.5, 4.0)),
        lambda d: misalign(d, *rng.normal(0, 0.6, 2)),
        lambda d: add_noise(d, rng, step * log_uniform(rng, 0.02, 1.0), log_uniform(rng, 0.3, 6.0)),
        lambda d: rescale(d, exp(rng.normal(0, 0.05)), step * rng.normal(0, 0.3)),
        lambda d: quantise(d, step * log_uniform(rng, 0.05, 1.0)),
    ]
    # In the order in which they happen to a map: lost detail first, rounding for storage last.
    for index in sorted(rng.choice(len(faults), rng.integers(1, MOST_FAULTS + 1), replace=False)):
        disparity = faults[index](disparity)
    return disparity
