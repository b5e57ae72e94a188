"""Degrade exact disparity maps as real maps are: soft edges, noise, coarse steps, few pixels, shifts, a wrong scale.

Maps are (H, W) float32, in pixels per view step.
"""

from __future__ import annotations

from collections.abc import Callable
from math import exp

import numpy as np
import torch
from torch.nn import functional

from iibr_core.training.distributions import log_uniform
from iibr_core.training.epi_loss import correlate, gaussian
from iibr_core.types import FloatImage

MAX_FAULTS = 3
EXACT_SHARE = 0.4
"""Share of maps that stay exact, as rendered scenes have them: the transformer must not spoil good maps."""


def blur(disparity: FloatImage, sigma_px: float) -> FloatImage:
    """Return the map convolved with a Gaussian; sigma 0 changes nothing."""
    taps = gaussian(max(sigma_px, 1e-3))
    return correlate(torch.from_numpy(disparity).double(), taps, taps).float().numpy()


def add_noise(disparity: FloatImage, rng: np.random.Generator, strength: float, grain_px: float) -> FloatImage:
    """Return the map with Gaussian noise. strength: its standard deviation; grain_px: sigma of its grains."""
    grains = blur(rng.standard_normal(disparity.shape, np.float32), grain_px)
    return disparity + grains * np.float32(strength / grains.std())


def quantise(disparity: FloatImage, step: float) -> FloatImage:
    """Return the map rounded to multiples of a step."""
    return np.asarray(np.rint(disparity / step) * step, np.float32)


def coarsen(disparity: FloatImage, factor: int) -> FloatImage:
    """Return the map averaged over squares of factor x factor pixels, then enlarged bilinearly."""
    height, width = disparity.shape
    means = functional.avg_pool2d(torch.from_numpy(disparity)[None, None], factor, ceil_mode=True)
    large = functional.interpolate(means, scale_factor=factor, mode="bilinear")
    return large[0, 0, :height, :width].contiguous().numpy()


def misalign(disparity: FloatImage, down_px: float, right_px: float) -> FloatImage:
    """Return the map moved against the photo, with bilinear interpolation."""
    height, width = disparity.shape
    move = torch.tensor([[[1, 0, -2 * right_px / width], [0, 1, -2 * down_px / height]]], dtype=torch.float32)
    places = functional.affine_grid(move, [1, 1, height, width], align_corners=False)
    image = torch.from_numpy(disparity)[None, None]
    return functional.grid_sample(image, places, padding_mode="border", align_corners=False)[0, 0].numpy()


def rescale(disparity: FloatImage, scale: float, shift: float) -> FloatImage:
    """Return the map times scale, plus shift: errors of wrongly estimated scale and shift."""
    return np.asarray(disparity * scale + shift, np.float32)


def degrade(disparity: FloatImage, rng: np.random.Generator, views: float) -> FloatImage:
    """Return the map with up to three random faults, or as exact as it was.

    views: the largest view offset that will be rendered. The effect of noise, steps and shift is in pixels there.
    """
    if rng.random() < EXACT_SHARE:
        return disparity
    step = 1 / views
    faults: list[Callable[[FloatImage], FloatImage]] = [
        lambda d: coarsen(d, int(rng.integers(2, 5))),
        lambda d: blur(d, log_uniform(rng, 0.5, 4.0)),
        lambda d: misalign(d, *rng.normal(0, 0.6, 2)),
        lambda d: add_noise(d, rng, step * log_uniform(rng, 0.02, 1.0), log_uniform(rng, 0.3, 6.0)),
        lambda d: rescale(d, exp(rng.normal(0, 0.05)), step * rng.normal(0, 0.3)),
        lambda d: quantise(d, step * log_uniform(rng, 0.05, 1.0)),
    ]
    # Faults come in the order in which they happen to a map: lost detail first, rounding for storage last.
    for index in sorted(rng.choice(len(faults), rng.integers(1, MAX_FAULTS + 1), replace=False)):
        disparity = faults[index](disparity)
    return disparity
