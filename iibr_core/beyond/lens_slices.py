"""Slices of defocus, and the disc of each: a picture through a lens is made of slices that are blurred one by one.

A slice holds the pixels with about the same defocus: its disc has one diameter, in pixels of the picture, positive for
surfaces nearer than the focus. Wide discs are drawn at a reduced size, so all discs cost about the same.
Plain arrays, no GL; web/renderer.js has the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_shape import opening
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
WIDEST_TEXELS = 19.0
"""Diameter of a disc, in pixels of the size at which it is drawn, from which on the size is halved."""
MAX_TAPS = 320
"""Largest number of samples of a disc: a square mask turned by 45 degrees takes as many."""
SUBSAMPLES = 4
"""Samples of the aperture across a pixel."""
STEPS_A_TEXEL = 16
"""Number of different diameters of a disc for each pixel of the size at which it is drawn."""
REDUCTION_BLUR = 16 / 6
"""Square of the diameter of the disc, in reduced pixels, that blurs as much as reduction and enlargement."""


@dataclass(frozen=True, eq=False)
class Slice:
    """A slice of defocus.

    diameter_px: of its disc, negative behind the focus. level: binary logarithm of the reduction. taps (N, 3): samples
    of the disc as (x, y, weight), in reduced pixels from the middle, each the mean of up to four pixels; their weights
    sum to 1.
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
    level = max(int(np.floor(np.log2(max(abs(diameter_px), 1e-9) / WIDEST_TEXELS))) + 1, 0)
    texels = round(diameter_px / 2.0**level * STEPS_A_TEXEL) / STEPS_A_TEXEL
    return Slice(diameter_px, level, disc_taps(shape, texels, level > 0))


@lru_cache(maxsize=1024)
def disc_taps(shape: ApertureShape, diameter: float, is_reduced: bool) -> Doubles:
    """Return the samples of a disc, see `Slice.taps`. diameter: in pixels of the size at which it is drawn."""
    if abs(diameter) < SHARP_PX:
        return np.array([[0.0, 0.0, 1.0]])
    # Reduction and enlargement blur, too: the disc is smaller by as much, so that the whole has its width.
    diameter *= (1 - (REDUCTION_BLUR / diameter**2 if is_reduced else 0.0)) ** 0.5
    half = 2 * (int(np.ceil(abs(diameter) * _reach(shape) / 2 + 0.5)) // 2 + 1)
    fine = (np.arange(2 * half * SUBSAMPLES) + 0.5) / SUBSAMPLES - half - 0.5
    t, s = np.meshgrid(fine / diameter, fine / diameter, indexing="ij")
    covered = opening(shape, t, s, 1.0, 1 / (SUBSAMPLES * abs(diameter)))
    covered = covered.reshape(2 * half, SUBSAMPLES, 2 * half, SUBSAMPLES).mean(axis=(1, 3))
    # One bilinear sample for two by two pixels has their weights along rows and along columns.
    cells = covered.reshape(half, 2, half, 2)
    weight = cells.sum(axis=(1, 3))
    with np.errstate(invalid="ignore"):
        x, y = cells[:, :, :, 1].sum(axis=1) / weight, cells[:, 1].sum(axis=2) / weight
    row, column = np.nonzero(weight > 1e-4)
    at = row, column
    taps = np.stack([2 * column - half + x[at], 2 * row - half + y[at], weight[at] / weight.sum()], axis=1)
    return taps if len(taps) else np.array([[0.0, 0.0, 1.0]])


def _reach(shape: ApertureShape) -> float:
    """Return the diameter of the circle around an opening of diameter 1."""
    return 2**0.5 if shape.kind == "mask" else 1.0
