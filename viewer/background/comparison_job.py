"""Makes the view that is compared with the truth, and the entropy of weights."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.color import bytes_from_encoded, convert, encoded_from_stored
from iibr_core.evaluation.metrics import flip, psnr
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import read_stored_view
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.method.light_field import complete_rays, encode_for_storage, stored_colors
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.plan import ScenePlan, plan_literal
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import RaySet
from iibr_core.method.view import Renderer
from iibr_core.runtime.extras import is_installed
from iibr_core.runtime.tiling import THREADS
from iibr_core.runtime.work import is_stopped
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.types import SRGB, ColorSpace, FloatImage, GridShape, InputError, StoredColors
from viewer.background.comparison import (
    Bytes,
    ComparisonFinding,
    ComparisonInputs,
    EntropyReady,
    PairReady,
    PairScored,
)
from viewer.model.inspection_request import InspectionRequest


class ComparisonJob:
    """Carries requests out, in whatever thread calls it; keeps rays and the last pair from one request to the next."""

    def __init__(self) -> None:
        self._rays: RaySet | None = None
        self._rays_of: tuple[int, GridShape | None] | None = None
        self._pair: PairReady | None = None

    def results_of(self, request: InspectionRequest, inputs: ComparisonInputs) -> Iterator[ComparisonFinding]:
        """Yield the results of a request, in order. Raises InputError, or Cancelled once the job is stopped.

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
        assert request.truth is not None
        truth = read_stored_view(open_light_field(Path(os.path.expanduser(request.truth.path))), *request.view)
        made = self._stored_view(request, inputs) if inputs.stored is None else inputs.stored
        if truth.shape != made.shape:
            raise InputError(f"{request.truth.path}: its views have changed; choose the folder again")
        return _bytes_of(made, inputs.color_space), _bytes_of(truth)

    def _stored_view(self, request: InspectionRequest, inputs: ComparisonInputs) -> StoredColors:
        """Return the view as the light field stores it; the middle one is the photo."""
        loaded, plan = _given(request, inputs)
        is_hdr = loaded.photo.is_hdr
        if request.view == plan.grid.centre:
            return encode_for_storage(loaded.photo.pixels, is_hdr)
        renderer, offset = _renderer(inputs), plan.grid.offset(*request.view)
        rays = self._kept_rays(request, inputs)
        return stored_colors(rays, offset, renderer.render(rays, offset, THREADS), is_hdr)

    def _entropy(self, request: InspectionRequest, inputs: ComparisonInputs) -> FloatImage:
        """Return the entropy of the view's weights (H, W), in [0, 1]; in the middle every ray is the photo's own."""
        loaded, plan = _given(request, inputs)
        if request.view == plan.grid.centre:
            return np.zeros(loaded.photo.size, np.float32)
        return view_entropy(self._kept_rays(request, inputs), plan.grid.offset(*request.view))

    def _kept_rays(self, request: InspectionRequest, inputs: ComparisonInputs) -> RaySet:
        """Return the ray set of the scene's plan, or of the ground truth's places."""
        loaded, plan = _given(request, inputs)
        rays_of = request.generation, request.truth.grid if request.truth is not None else None
        if self._rays is None or self._rays_of != rays_of:
            self._rays = None  # two sets would be large
            self._rays = complete_rays(loaded.photo, plan.field_disparity(loaded.disparity), plan, _renderer(inputs))
            self._rays_of = rays_of
        return self._rays


def _renderer(inputs: ComparisonInputs) -> Renderer:
    return Renderer(shipped_transformer(), load_inpainter(inputs.inpaint))


def _given(request: InspectionRequest, inputs: ComparisonInputs) -> tuple[LoadedPhoto, ScenePlan]:
    """Return the photo, and the plan of its scene or of the ground truth's places."""
    loaded, plan = inputs.loaded, inputs.plan
    assert loaded is not None
    assert plan is not None
    if request.truth is not None:
        plan = plan_literal(loaded.photo, loaded.disparity, request.truth.grid)
    return loaded, plan


def _bytes_of(stored: StoredColors, color_space: ColorSpace = SRGB) -> Bytes:
    """Return stored colours of a space as sRGB bytes; what exceeds white is white."""
    return bytes_from_encoded(convert(encoded_from_stored(stored), SRGB, color_space))
