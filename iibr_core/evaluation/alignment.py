"""Scale and shift that an estimated disparity leaves open, fitted to true views: what a better scale would be worth."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.types import FloatImage, ViewOffset

FIT_PIXELS = 12_000
END_SHARES = (-0.08, -0.04, -0.02, -0.01, 0.0, 0.01, 0.02, 0.04, 0.08)
"""How far the far and the near end move to the farthest view, in widths: what is tried first."""
END_STEP = 0.005
LEAST_ERROR = 1e-12
"""Squared errors below count as this."""


def fit_to_views(
    photo: FloatImage, estimate: FloatImage, truths: Sequence[tuple[ViewOffset, FloatImage]]
) -> FloatImage:
    """The estimate (H, W) scaled and shifted so that warping the photo (H, W, 3) comes nearest to true views
    [(offset, (H, W, 3)), ...]. Found on small copies by the mean difference, which holes mislead less than its square;
    the estimate stays as it is where its PSNR is higher at full size.
    """
    low, high = (float(p) for p in np.percentile(estimate, (1, 99)))
    farthest = max((max(abs(at.t), abs(at.s)) for at, _ in truths), default=0.0)
    if not high > low or farthest == 0:
        return estimate
    share = (estimate - np.float32(low)) / np.float32(high - low)
    step = max(math.ceil(math.sqrt(estimate.size / FIT_PIXELS)), 1)
    small_photo, small_share = _smaller(photo, step), _smaller(share[..., None], step)[..., 0]
    small_truths = [(at, _smaller(truth, step)) for at, truth in truths]
    unit = small_photo.shape[1] / farthest

    def error(ends: np.ndarray) -> float:
        disparity = (ends[0] + (ends[1] - ends[0]) * small_share) * np.float32(unit)
        warped = ((reference_warp(small_photo, disparity, at).colors, truth) for at, truth in small_truths)
        return float(np.mean([np.abs(colors - truth).mean() for colors, truth in warped]))

    own = np.array([low, high]) / (unit * step)
    start = min((own, *(np.array([far, near]) for far in END_SHARES for near in END_SHARES)), key=error)
    around = start + np.array([[0, 0], [1, 0], [0, 1]]) * END_STEP
    far, near = minimize(error, start, method="Nelder-Mead", options={"initial_simplex": around, "maxiter": 60}).x
    fitted = np.asarray((far + (near - far) * share) * (unit * step), np.float32)
    return min((estimate, fitted), key=lambda disparity: _error_db(photo, disparity, truths))


def _error_db(photo: FloatImage, disparity: FloatImage, truths: Sequence[tuple[ViewOffset, FloatImage]]) -> float:
    """Mean over true views of the squared error of the warped photo, in decibels: what PSNR counts."""
    errors = [((reference_warp(photo, disparity, at).colors - truth) ** 2).mean() for at, truth in truths]
    return float(np.mean(10 * np.log10(np.maximum(errors, LEAST_ERROR))))


def _smaller(image: FloatImage, step: int) -> FloatImage:
    """Means (h, w, C) over blocks of step x step pixels of an image (H, W, C); what is left over is cut off."""
    height, width = image.shape[0] // step * step, image.shape[1] // step * step
    blocks = image[:height, :width].reshape(height // step, step, width // step, step, image.shape[2])
    return np.asarray(blocks.mean(axis=(1, 3)), np.float32)
