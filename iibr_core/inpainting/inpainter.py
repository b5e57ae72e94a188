"""What a way of inpainting is to the renderer. Imports nothing heavy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, ViewOffset

EstimateDepth = Callable[[FloatImage], FloatImage]
"""Of colours (H, W, 3), sRGB-encoded: inverse depth (H, W), any scale and offset, larger is nearer. Raises InputError
where it cannot.
"""


@dataclass(frozen=True)
class InpaintingAids:
    """What inpainters may ask. estimate_depth: what gave the photo's depth, None where that was no model."""

    estimate_depth: EstimateDepth | None = None


class Inpainter(Protocol):
    """Fills the holes of one view. Several threads may call the same inpainter, each for a view of its own."""

    def __call__(
        self,
        colors: FloatImage,
        disparity: FloatImage,
        hole: NDArray[np.bool_],
        photo_disparity: FloatImage,
        offset: ViewOffset,
        threads: int = 1,
    ) -> None:
        """Write colors (H, W, 3), sRGB-encoded, and disparity (H, W), px per view step, where hole (H, W) is True.

        Nothing else of the view may change; what stands in its holes before means nothing. All that is written is
        finite. photo_disparity (H, W): the centre view's, which tells what could be hidden there. offset: of this view.
        threads: run so many at most; the result is the same for any number.
        """
