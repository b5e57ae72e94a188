"""How far a picture is from the true one: PSNR, SSIM, FLIP, of sRGB-encoded colours (LPIPS: see lpips.py).

All take (image, truth), (H, W, 3), and a mask (H, W) of the pixels that count, None for all; NaN where none does.
Floats hold 1 for white, bytes 255; either gives the same. Light to import: the viewer uses it too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage

Mask = NDArray[np.bool_]
Image = FloatImage | NDArray[np.uint8]

MOST_DB = 100.0
"""What equal pictures count as where means are taken."""
SSIM_SIGMA = 1.5
SSIM_LEAST_PX = 11


def psnr(image: Image, truth: Image, mask: Mask | None = None) -> float:
    """Peak signal-to-noise ratio in dB, infinite where the pictures are equal."""
    white = 255 if image.dtype == np.uint8 else 1
    error = np.square(image.astype(np.float64) - truth)
    error = error if mask is None else error[mask]
    if not error.size:
        return math.nan
    mean_square = float(error.mean())
    return math.inf if mean_square == 0 else 10 * math.log10(white**2 / mean_square)


def bounded_psnr(image: Image, truth: Image, mask: Mask | None = None) -> float:
    """`psnr`, at most MOST_DB: for means and reports, which one pair of equal pictures must not make infinite."""
    ratio = psnr(image, truth, mask)
    return ratio if math.isnan(ratio) else min(ratio, MOST_DB)


def ssim(image: FloatImage, truth: FloatImage, mask: Mask | None = None) -> float:
    """Structural similarity (Wang et al. 2004): Gaussian window of sigma 1.5, mean over channels. NaN below 11 px."""
    if min(truth.shape[:2]) < SSIM_LEAST_PX:
        return math.nan
    from skimage.metrics import structural_similarity

    mean, of_pixels = structural_similarity(
        image,
        truth,
        channel_axis=2,
        data_range=1,
        gaussian_weights=True,
        sigma=SSIM_SIGMA,
        use_sample_covariance=False,
        full=True,
    )
    if mask is None:
        return float(mean)
    return float(of_pixels[mask].mean()) if mask.any() else math.nan


def flip_map(image: Image, truth: Image) -> FloatImage:
    """FLIP (Andersson et al. 2020) of each pixel (H, W), 0 = no difference to be seen, 67 pixels per degree."""
    from flip_evaluator import evaluate

    of_pixels, _, _ = evaluate(*_writable_floats(truth, image), "LDR", True, False)
    return np.asarray(of_pixels, np.float32).reshape(truth.shape[:2])


def flip_picture(image: Image, truth: Image) -> FloatImage:
    """`flip_map` in the colours of its authors (magma), (H, W, 3): black where nothing differs."""
    from flip_evaluator import evaluate

    shown, _, _ = evaluate(*_writable_floats(truth, image), "LDR", True, True)
    return np.asarray(shown, np.float32)


def _writable_floats(*images: Image) -> list[FloatImage]:
    """Copies, 1 = white: FLIP's binding refuses arrays that may not be written to."""
    floats = (image / np.float32(255) if image.dtype == np.uint8 else image for image in images)
    return [np.array(image, np.float32, order="C") for image in floats]


def flip(image: Image, truth: Image, mask: Mask | None = None) -> float:
    """Mean of `flip_map`."""
    of_pixels = flip_map(image, truth)
    of_pixels = of_pixels if mask is None else of_pixels[mask]
    return float(of_pixels.mean(dtype=np.float64)) if of_pixels.size else math.nan
