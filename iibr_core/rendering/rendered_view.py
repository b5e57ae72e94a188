"""A view as it is rendered; what was filled, decided or known of it: records that travel between rooms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, ImageSize


@dataclass(frozen=True, eq=False)
class RaysBehind:
    """What was filled behind N rays that surfaces cover in part: their pixels (N), counted row by row, its colors
    (N, 3), sRGB-encoded, and disparity (N).
    """

    pixel: NDArray[np.int64]
    colors: FloatImage
    disparity: FloatImage


@dataclass(frozen=True, eq=False)
class RenderedView:
    """A view without holes.

    colors: (H, W, 3) sRGB-encoded. disparity: (H, W). occluded: (H, W), True where no source showed anything, so that
    it was filled here. inpainted: (H, W), True where the photo showed nothing: filled here or in an earlier view.
    entropy: (H, W) in [0, 1], of the closed form's weights, or None where it was not asked for. behind: what was filled
    here and shows beside something in front of it, None without any.
    """

    colors: FloatImage
    disparity: FloatImage
    occluded: NDArray[np.bool_]
    inpainted: NDArray[np.bool_]
    entropy: FloatImage | None = None
    behind: RaysBehind | None = None

    @classmethod
    def blank(cls, size: ImageSize, with_entropy: bool) -> RenderedView:
        """A view (height, width) to be written to."""
        colors, disparity = np.empty((*size, 3), np.float32), np.empty(size, np.float32)
        occluded, inpainted = np.empty(size, np.bool_), np.empty(size, np.bool_)
        return cls(colors, disparity, occluded, inpainted, np.empty(size, np.float32) if with_entropy else None)

    @property
    def has_filled_rays(self) -> bool:
        """Whether anything was filled here."""
        return self.behind is not None or bool(self.occluded.any())


@dataclass(frozen=True, eq=False)
class DecidedRays:
    """Rays (N) of one view: pixel, the index into its pixels row by row; colors (N, 3), disparity (N) and inpainted (N)
    as in `RenderedView`.
    """

    pixel: NDArray[np.int32]
    colors: FloatImage
    disparity: FloatImage
    inpainted: NDArray[np.bool_]
