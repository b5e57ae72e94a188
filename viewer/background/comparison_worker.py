"""Work beside the scene worker's: a view to compare with the truth, its score, the entropy of weights.

The newest request wins. Rays and images are kept only as long as something is looked at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.types import SRGB, ColorSpace, StoredColors
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model.inspection_request import InspectionRequest

if TYPE_CHECKING:
    from viewer.background.comparison_job import ComparisonJob

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class ComparisonInputs:
    """What requests are made from: the photo and its plan, or the stored view (H, W, 3) of a light field from disk, in
    sRGB.

    inpaint: of the scene's own views.
    """

    loaded: LoadedPhoto | None = None
    plan: ScenePlan | None = None
    stored: StoredColors | None = None
    inpaint: str = DEFAULT_INPAINTER

    @property
    def color_space(self) -> ColorSpace:
        """Of what is made from them."""
        return SRGB if self.loaded is None else self.loaded.photo.color_space


@dataclass(frozen=True, eq=False)
class ComparisonRequest:
    """What to find out, and from what; both None: nothing, and what is kept may go."""

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
    """How far the pair of this request is apart: PSNR (infinite where equal), and the mean of FLIP, None where its
    package is not installed.
    """

    request: InspectionRequest
    psnr_db: float
    flip: float | None


@dataclass(frozen=True, eq=False)
class EntropyReady:
    """Entropy (H, W) of the view of this request, 255 = 1."""

    request: InspectionRequest
    entropy: Bytes


ComparisonFinding = PairReady | PairScored | EntropyReady
ComparisonResult = ComparisonFinding | Failed[InspectionRequest | None]


class ComparisonWorker(JobThread[ComparisonRequest, ComparisonResult]):
    """Carries out the newest request. wanted: what it is about."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when something was found."""
        super().__init__("iibr-comparison", wake, self._compare, lambda asked, message: Failed(asked.id, message))
        self.wanted: InspectionRequest | None = None
        self._comparison_job: ComparisonJob | None = None

    def want(self, request: InspectionRequest | None, inputs: ComparisonInputs | None) -> None:
        """Find this out instead of anything else; nothing happens if it is wanted already, or inputs are missing."""
        if request == self.wanted or (request is not None and inputs is None):
            return
        self.wanted = request
        self.submit(ComparisonRequest(request, inputs))

    def _compare(self, job: Job[ComparisonRequest, ComparisonResult]) -> Iterator[ComparisonResult]:
        request, inputs = job.request.id, job.request.inputs
        if request is None or inputs is None:
            self._comparison_job = None
            return
        from viewer.background.comparison_job import ComparisonJob

        self._comparison_job = self._comparison_job or ComparisonJob()
        yield from self._comparison_job.results_of(request, inputs)
