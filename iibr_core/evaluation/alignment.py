"""The plane, and the scale and shift of a map, that bring warped photos nearest to true views.

Depth from one photo leaves scale and shift open; views compared at the best ones show how good its shape is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.types import FloatImage

Warp = Callable[[FloatImage, FloatImage], FloatImage]
"""Makes one view (H, W, 3) of a photo (H, W, 3) with disparity (H, W)."""

FIT_PIXELS = 12_000
"""Size of the copies that are fitted, in pixels: a fit takes a hundred warps."""


class ViewFit:
    """Fits disparity to true views [(warp, (H, W, 3)), ...] of a photo (H, W, 3), on small copies.

    farthest: largest offset of the views, in view steps. Shifts are those of the farthest view, in picture widths.
    """

    def __init__(self, photo: FloatImage, truths: Sequence[tuple[Warp, FloatImage]], farthest: float) -> None:
        self._photo, self._truths = photo, truths
        self._step = math.ceil(math.sqrt(photo[..., 0].size / FIT_PIXELS))
        self._small_photo = _smaller(photo, self._step)
        self._small_truths = [(warp, _smaller(truth, self._step)) for warp, truth in truths]
        self._unit = self._small_photo.shape[1] / max(farthest, 1e-9)

    @cached_property
    def plane(self) -> float:
        """Disparity of the plane whose views are nearest to the true ones."""
        flat = np.ones(self._small_photo.shape[:2])
        best = min(np.linspace(-0.08, 0.08, 65), key=lambda shift: self._error(shift * flat))
        found = minimize(lambda shift: self._error(shift * flat), [best], method="Nelder-Mead")
        return float(found.x[0] * self._unit * self._step)

    def fitted(self, estimate: FloatImage) -> FloatImage:
        """Return the estimate (H, W) at its best scale and shift; unchanged where that is no nearer at full size."""
        low, high = (float(p) for p in np.percentile(estimate, (1, 99)))
        if not high > low:
            return np.full_like(estimate, self.plane)
        share = (estimate - np.float32(low)) / np.float32(high - low)
        small = _smaller(share[..., None], self._step)[..., 0]
        # The range opens from the best plane to either side, because either end may be near.
        middle = self.plane / (self._unit * self._step)
        simplex = middle + np.array([[0, 0], [-1, 1], [1, 1]]) * 0.01
        far, near = minimize(
            lambda ends: self._error(ends[0] + (ends[1] - ends[0]) * small),
            simplex[0],
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "maxiter": 100},
        ).x
        moved = np.asarray((far + (near - far) * share) * (self._unit * self._step), np.float32)
        return max((estimate, moved), key=self._psnr)

    def _error(self, shift: FloatImage) -> float:
        """Return the mean difference of the small views, which holes mislead less than its square. shift: (h, w)."""
        disparity = np.asarray(shift * self._unit, np.float32)
        errors = [np.abs(warp(self._small_photo, disparity) - truth).mean() for warp, truth in self._small_truths]
        return float(np.mean(errors))

    def _psnr(self, disparity: FloatImage) -> float:
        return float(np.mean([bounded_psnr(warp(self._photo, disparity), truth) for warp, truth in self._truths]))


def _smaller(image: FloatImage, step: int) -> FloatImage:
    """Return means (h, w, C) over blocks of step x step pixels of an image (H, W, C), without the rest."""
    height, width = (max(length // step, 1) for length in image.shape[:2])
    cut = image[: height * step, : width * step]
    return np.asarray(cut.reshape(height, cut.shape[0] // height, width, cut.shape[1] // width, -1).mean((1, 3)))
