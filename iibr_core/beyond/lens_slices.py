"""Slices of defocus, and the disc of each: a picture through a lens is made of slices that are blurred one by one.

A slice holds the pixels with about the same defocus: its disc has one diameter, in pixels of the picture, positive for
surfaces nearer than the focus. Wide discs are drawn at a reduced size, so all discs cost about the same.
Plain arrays, no GL; web/slices.js has the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_shape import opening, reach_of
from iibr_core.beyond.optics import ApertureShape

Doubles = NDArray[np.float64]

MAX_SLICES = 32
"""Largest number of slices: a block of the picture has one bit for each."""
MIN_SPACING_PX, SPACING_SHARE = 1.5, 0.2
"""Largest difference of the discs in a slice: in pixels, and as a share of their diameter. The larger one counts."""
COARSER = 1.25
"""Factor on the differences if there are too many slices."""
SHARP_PX = 0.7
"""Diameter of a disc, in pixels, that blurs nothing."""
FULL_SIZE_PX = 12.0
"""Largest diameter of a disc that is drawn at full size, in pixels."""
WIDER_A_LEVEL = 2.5
"""Factor from one halving of the size to the next on the largest diameter: wider discs have more pixels."""
MAX_TAPS = 768
"""Largest number of samples of a disc: a square mask turned by 45 degrees takes as many."""
MIN_TAP = 1e-4
"""Smallest weight of a sample, in covered pixels."""
SUBSAMPLES = 4
"""Samples of the aperture across a pixel."""
STEPS_A_TEXEL = 16
"""Number of different diameters of a disc for each pixel of the size at which it is drawn."""
REDUCTION_BLUR = 1 / 12 + 1 / 12 + 1 / 6
"""Variance along an axis, in squared reduced pixels, of all that blurs a reduced slice beside its disc: the means over
pixels of the slice and of the disc, and linear interpolation at the end.
"""


@dataclass(frozen=True, eq=False)
class Slice:
    """A slice of defocus.

    diameter_px: of its disc, negative behind the focus. level: binary logarithm of the reduction. taps (N, 3): samples
    of the disc as (x, y, weight), in reduced pixels from the middle, each the mean of up to four pixels; their weights
    sum to 1, some are negative.
    """

    diameter_px: float
    level: int
    taps: Doubles

    @property
    def reach_px(self) -> float:
        """Distance in pixels from which light comes."""
        return 2.0**self.level * (float(np.abs(self.taps[:, :2]).max()) + 1.0)


def slices_of(defocus_px: Doubles, shape: ApertureShape) -> tuple[Slice, ...]:
    """Return the slices for these diameters of discs (any number, any order), from near to far; one if there are none.

    A surface whose defocus is the same everywhere gets a slice of exactly its disc.
    """
    values, factor = defocus_px.ravel(), 1.0
    while len(middles := _middles(values, factor)) > MAX_SLICES:
        factor *= COARSER
    return tuple(_slice(middle, shape) for middle in middles)


def _middles(values: Doubles, factor: float) -> list[float]:
    """Return the mean diameters, descending, of values that differ by little; 0 for those in focus."""
    sharp = MIN_SPACING_PX / 2
    near, far = np.sort(values[values > sharp]), np.sort(-values[values < -sharp])
    is_sharp = len(near) + len(far) < len(values) or not len(values)
    return _means(near, factor)[::-1] + [0.0] * is_sharp + [-mean for mean in _means(far, factor)]


def _means(values: Doubles, factor: float) -> list[float]:
    """Return the means of neighbouring values (ascending, positive) that differ by little."""
    means, first = list[float](), 0
    while first < len(values):
        width = factor * max(MIN_SPACING_PX, SPACING_SHARE * values[first])
        last = int(np.searchsorted(values, values[first] + width, side="right"))
        means.append(float(values[first:last].mean()))
        first = last
    return means


def _slice(diameter_px: float, shape: ApertureShape) -> Slice:
    wider = max(abs(diameter_px) / FULL_SIZE_PX, 1.0)
    level = math.ceil(math.log(wider, WIDER_A_LEVEL) - 1e-9)
    texels = round(diameter_px / 2.0**level * STEPS_A_TEXEL) / STEPS_A_TEXEL
    return Slice(diameter_px, level, disc_taps(shape, texels, level > 0))


@lru_cache(maxsize=1024)
def disc_taps(shape: ApertureShape, diameter: float, is_reduced: bool) -> Doubles:
    """Return the samples of a disc, see `Slice.taps`. diameter: in pixels of the size at which it is drawn."""
    if abs(diameter) < SHARP_PX:
        return np.array([[0.0, 0.0, 1.0]])
    half = 2 * (int(np.ceil(abs(diameter) * reach_of(shape) / 2 + 1.5)) // 2 + 1)
    fine = (np.arange(2 * half * SUBSAMPLES) + 0.5) / SUBSAMPLES - half - 0.5
    t, s = np.meshgrid(fine / diameter, fine / diameter, indexing="ij")
    covered = opening(shape, t, s, 1.0, 1 / (SUBSAMPLES * abs(diameter)))
    covered = covered.reshape(2 * half, SUBSAMPLES, 2 * half, SUBSAMPLES).mean(axis=(1, 3))
    if is_reduced:
        covered = _sharpened(covered)
    taps = np.concatenate([_bilinear_taps(np.maximum(covered, 0.0)), _bilinear_taps(np.minimum(covered, 0.0))])
    return taps / [1.0, 1.0, taps[:, 2].sum()] if len(taps) else np.array([[0.0, 0.0, 1.0]])


def _sharpened(kernel: Doubles) -> Doubles:
    """Return a kernel whose variance is less by REDUCTION_BLUR: all together then blurs as the kernel alone."""
    around = np.pad(kernel, 1)
    beside = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
    return kernel - REDUCTION_BLUR / 2 * (beside - 4 * kernel)


def _bilinear_taps(kernel: Doubles) -> Doubles:
    """Return samples (x, y, weight) of a kernel of one sign: one bilinear sample has the weights of two by two pixels
    along rows and along columns.
    """
    half = len(kernel) // 2
    cells = kernel.reshape(half, 2, half, 2)
    weight = cells.sum(axis=(1, 3))
    row, column = at = np.nonzero(np.abs(weight) > MIN_TAP)
    x, y = cells[:, :, :, 1].sum(axis=1)[at] / weight[at], cells[:, 1].sum(axis=2)[at] / weight[at]
    return np.stack([2 * column - half + x, 2 * row - half + y, weight[at]], axis=1)
