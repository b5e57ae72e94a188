"""Records that the comparison worker takes and gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.types import SRGB, ColorSpace, StoredColors
from viewer.model.inspection_request import InspectionRequest

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class ComparisonInputs:
    """A photo and its plan, or the stored view (H, W, 3) of a light field from disk, in sRGB.

    inpaint: of the scene's own views.
    """

    loaded: LoadedPhoto | None = None
    plan: ScenePlan | None = None
    stored: StoredColors | None = None
    inpaint: str = DEFAULT_INPAINTER

    @property
    def color_space(self) -> ColorSpace:
        """Colour space of the views."""
        return SRGB if self.loaded is None else self.loaded.photo.color_space


@dataclass(frozen=True, eq=False)
class ComparisonRequest:
    """A question and what answers it; None and None: nothing is asked, and everything may be forgotten."""

    id: InspectionRequest | None = None
    inputs: ComparisonInputs | None = None


@dataclass(frozen=True, eq=False)
class PairReady:
    """Two images (H, W, 3), sRGB bytes, of the same view."""

    request: InspectionRequest
    left: Bytes
    right: Bytes


@dataclass(frozen=True)
class PairScored:
    """The difference of a pair: PSNR (infinite if equal), and the mean of FLIP, None if its package is missing."""

    request: InspectionRequest
    psnr_db: float
    flip: float | None


@dataclass(frozen=True, eq=False)
class EntropyReady:
    """Entropy (H, W) of the view of this request, 255 = 1."""

    request: InspectionRequest
    entropy: Bytes


ComparisonFinding = PairReady | PairScored | EntropyReady
