"""Distances of a picture from the true one: PSNR, SSIM and FLIP of sRGB-encoded colours (LPIPS: see lpips.py).

All take (image, truth), (H, W, 3), and a mask (H, W) of the pixels that count, None for all. They return NaN if no
pixel counts. Floats hold 1 for white, bytes 255. The viewer uses this module too, so its imports are light.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage

Mask = NDArray[np.bool_]
Image = FloatImage | NDArray[np.uint8]

MAX_DB = 100.0
"""Largest PSNR in means and reports, that of equal pictures."""


def psnr(image: Image, truth: Image, mask: Mask | None = None) -> float:
    """Return the peak signal-to-noise ratio in dB, infinite for equal pictures."""
    white = 255 if image.dtype == np.uint8 else 1
    error = np.square(image.astype(np.float64) - truth)
    error = error if mask is None else error[mask]
    if not error.size:
        return math.nan
    mean_square = float(error.mean())
    return math.inf if mean_square == 0 else 10 * math.log10(white**2 / mean_square)


def bounded_psnr(image: Image, truth: Image, mask: Mask | None = None) -> float:
    """Return `psnr`, at most MAX_DB: one pair of equal pictures must not make a mean infinite."""
    return min(psnr(image, truth, mask), MAX_DB)


def ssim(image: FloatImage, truth: FloatImage) -> float:
    """Return the structural similarity (Wang et al. 2004), mean over channels; NaN for pictures below its window."""
    if min(truth.shape[:2]) < 11:
        return math.nan
    from skimage.metrics import structural_similarity

    settings = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False}
    return float(structural_similarity(image, truth, channel_axis=2, data_range=1, **settings))


def flip_map(image: Image, truth: Image) -> FloatImage:
    """Return FLIP (Andersson et al. 2020) of each pixel (H, W) at 67 pixels per degree, 0 for no visible difference."""
    return _flip(image, truth, False).reshape(truth.shape[:2])


def flip_picture(image: Image, truth: Image) -> FloatImage:
    """Return `flip_map` in the colours of its authors (magma), (H, W, 3); black: no difference."""
    return _flip(image, truth, True)


def flip(image: Image, truth: Image, mask: Mask | None = None) -> float:
    """Return the mean of `flip_map`."""
    of_pixels = flip_map(image, truth)
    of_pixels = of_pixels if mask is None else of_pixels[mask]
    return float(of_pixels.mean(dtype=np.float64)) if of_pixels.size else math.nan


def _flip(image: Image, truth: Image, in_colors: bool) -> FloatImage:
    """Return FLIP as values or in colours. Its binding refuses arrays that may not be written to, hence copies."""
    from flip_evaluator import evaluate

    floats = (pixels / np.float32(255) if pixels.dtype == np.uint8 else pixels for pixels in (truth, image))
    shown, _, _ = evaluate(*(np.array(pixels, np.float32, order="C") for pixels in floats), "LDR", True, in_colors)
    return np.asarray(shown, np.float32)
