"""Work beside the scene worker's: single views for comparisons, their scores, the entropy of weights.

The newest request wins. Rays and images are kept only as long as something is looked at.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, convert, encoded_from_stored
from iibr_core.evaluation.metrics import flip, psnr
from iibr_core.generation.plan import ScenePlan, plan_literal
from iibr_core.inpainting.registry import DEFAULT_INPAINTER, load_inpainter
from iibr_core.runtime.extras import is_installed
from iibr_core.runtime.work import is_stopped
from iibr_core.scenes.loaded_photo import LoadedPhoto
from iibr_core.types import SRGB, ColorSpace, FloatImage, GridShape, InputError, Quality, StoredColors, ViewOffset
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model.inspection_request import InspectionRequest

if TYPE_CHECKING:
    from iibr_core.inpainting.inpainter import Inpainter
    from iibr_core.rendering.ray_set import RaySet

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class ComparisonInputs:
    """What requests are made from: the photo and its plan, or the stored view (H, W, 3) of a light field from disk, in
    sRGB.

    quality, inpaint: of the scene's own views.
    """

    quality: Quality
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


class ComparisonJob:
    """Carries requests out, in whatever thread calls it; keeps rays and the last pair from one request to the next."""

    def __init__(self) -> None:
        self._rays: RaySet | None = None
        self._rays_of: tuple[int, GridShape | None] | None = None
        self._outer: dict[ViewOffset, StoredColors] = {}  # of fast quality, by which the set was completed
        self._pair: PairReady | None = None

    def forget(self) -> None:
        """Free what is kept."""
        self._rays = self._rays_of = self._pair = None
        self._outer = {}

    def results_of(self, request: InspectionRequest, inputs: ComparisonInputs) -> Iterator[ComparisonFinding]:
        """What comes of a request, in order. Raises InputError, or Cancelled once should_stop is true.

        A pair that is kept comes again: who asked for it first may not have waited.
        """
        if request.kind == "entropy":
            yield EntropyReady(request, np.rint(self._entropy(request, inputs) * 255).astype(np.uint8))
            return
        unscored = replace(request, is_scored=False)
        if self._pair is None or self._pair.request != unscored:
            self._pair = PairReady(unscored, *self._make_pair(request, inputs))
        yield self._pair
        if request.is_scored and not is_stopped():
            left, right = self._pair.left, self._pair.right
            flip_mean = flip(left, right) if is_installed("flip_evaluator") else None
            yield PairScored(request, psnr(left, right), flip_mean)

    def _make_pair(self, request: InspectionRequest, inputs: ComparisonInputs) -> tuple[Bytes, Bytes]:
        if request.truth is not None:
            from iibr_core.formats.light_fields.light_field_formats import open_light_field
            from iibr_core.formats.light_fields.views import read_stored_view

            truth = read_stored_view(open_light_field(Path(os.path.expanduser(request.truth.path))), *request.view)
            made = inputs.stored
            if made is None:
                made = self._stored_view(request, inputs, inputs.quality)
            if truth.shape != made.shape:
                raise InputError(f"{request.truth.path}: its views have changed; choose the folder again")
            return _bytes_of(made, inputs.color_space), _bytes_of(truth)
        fast, balanced = (self._stored_view(request, inputs, quality) for quality in get_args(Quality))
        return _bytes_of(fast, inputs.color_space), _bytes_of(balanced, inputs.color_space)

    def _stored_view(self, request: InspectionRequest, inputs: ComparisonInputs, quality: Quality) -> StoredColors:
        """The view as the light field stores it; the middle one is the photo."""
        from iibr_core.generation.light_field import transformer_for
        from iibr_core.generation.stored_views import encode_for_storage, stored_colors
        from iibr_core.rendering.renderer import open_renderer

        loaded, plan = _given(request, inputs)
        if request.view == plan.grid.centre:
            return encode_for_storage(loaded.photo.pixels, loaded.photo.is_hdr)
        inpainter, offset = load_inpainter(inputs.inpaint), plan.grid.offset(*request.view)
        rays = self._kept_rays(request, inputs, inpainter)
        if quality == "fast" and offset in self._outer:
            return self._outer[offset]
        transformer = transformer_for(quality)
        with open_renderer(transformer, inpainter=inpainter) as renderer:
            return stored_colors(rays, offset, renderer.render(rays, offset), loaded.photo.is_hdr)

    def _entropy(self, request: InspectionRequest, inputs: ComparisonInputs) -> FloatImage:
        """Of the weights of the view (H, W), in [0, 1]; in the middle every ray is the photo's own."""
        from iibr_core.rendering.renderer import open_renderer

        loaded, plan = _given(request, inputs)
        if request.view == plan.grid.centre:
            return np.zeros(loaded.photo.size, np.float32)
        inpainter = load_inpainter(inputs.inpaint)
        rays = self._kept_rays(request, inputs, inpainter)
        with open_renderer(keeps_entropy=True, inpainter=inpainter) as renderer:
            entropy = renderer.render(rays, plan.grid.offset(*request.view)).entropy
        assert entropy is not None
        return np.clip(entropy, 0, 1)

    def _kept_rays(
        self,
        request: InspectionRequest,
        inputs: ComparisonInputs,
        inpainter: Inpainter,
    ) -> RaySet:
        """The ray set of the scene's plan, or of the ground truth's places."""
        from iibr_core.generation.light_field import ray_set
        from iibr_core.generation.stored_views import stored_colors

        loaded, plan = _given(request, inputs)
        rays_of = request.generation, request.truth.grid if request.truth is not None else None
        if self._rays is None or self._rays_of != rays_of:
            self._rays, self._outer = None, {}  # two sets would be large
            disparity = plan.field_disparity(loaded.disparity)
            rays, outer_views = ray_set(loaded.photo, disparity, plan, inpainter)
            is_hdr = loaded.photo.is_hdr
            self._outer = {at: stored_colors(rays, at, view, is_hdr) for at, view in outer_views}
            self._rays, self._rays_of = rays, rays_of
        return self._rays


def _given(request: InspectionRequest, inputs: ComparisonInputs) -> tuple[LoadedPhoto, ScenePlan]:
    """The photo, and the plan of its scene or of the ground truth's places."""
    loaded, plan = inputs.loaded, inputs.plan
    assert loaded is not None
    assert plan is not None
    if request.truth is not None:
        plan = plan_literal(loaded.photo, loaded.disparity, request.truth.grid)
    return loaded, plan


class ComparisonWorker(JobThread[ComparisonRequest, ComparisonResult]):
    """Carries out the newest request. wanted: what it is about."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when something was found."""
        super().__init__("iibr-comparison", wake, self._compare, lambda asked, message: Failed(asked.id, message))
        self.wanted: InspectionRequest | None = None
        self._comparison_job = ComparisonJob()

    def want(self, request: InspectionRequest | None, inputs: ComparisonInputs | None) -> None:
        """Find this out instead of anything else; nothing happens if it is wanted already, or inputs are missing."""
        if request == self.wanted or (request is not None and inputs is None):
            return
        self.wanted = request
        self.submit(ComparisonRequest(request, inputs))

    def _compare(self, job: Job[ComparisonRequest, ComparisonResult]) -> Iterator[ComparisonResult]:
        request, inputs = job.request.id, job.request.inputs
        if request is None or inputs is None:
            self._comparison_job.forget()
        else:
            yield from self._comparison_job.results_of(request, inputs)


def _bytes_of(stored: StoredColors, color_space: ColorSpace = SRGB) -> Bytes:
    """Stored colours of a space as sRGB bytes; what exceeds white is white."""
    return bytes_from_encoded(convert(encoded_from_stored(stored), SRGB, color_space))
