"""The views of a trial: as they are, by the reference warp, and as the program makes them. Cameras of a scene stand on
a plane and look the same way, or freely.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from types import TracebackType
from typing import Protocol, Self

import numpy as np

from iibr_core.evaluation.datasets import read_straight_view, read_view
from iibr_core.evaluation.metrics import Mask
from iibr_core.evaluation.reference_warp import WarpedView, reference_warp, reference_warp_to
from iibr_core.evaluation.trials import Trial
from iibr_core.generation.free_views import FreeViews
from iibr_core.generation.view_maker import ViewMaker
from iibr_core.inpainting.background import fill_background
from iibr_core.rendering.free_view import target_from_photo
from iibr_core.rendering.rendered_view import RenderedView
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import Camera, FloatImage, Quality, image_size

LEAST_STATED_SHARE = 0.1
"""Of the least disparity that the data set states: what an estimate puts farther away, or behind us, is there."""


class TrialViews(Protocol):
    """Makes the judged views of a trial, by their index in the scene; a context manager.

    qualities: that it makes.
    """

    qualities: tuple[Quality, ...]

    def __enter__(self) -> Self:
        """Make ready for views."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let go of what it holds."""

    def truth(self, index: int) -> tuple[FloatImage, Mask]:
        """Colours (H, W, 3) of a view, and where they are known (H, W)."""

    def warp(self, disparity: FloatImage, index: int) -> WarpedView:
        """The reference warp by a disparity (H, W)."""

    def timed_view(self, quality: Quality, index: int) -> tuple[RenderedView, float]:
        """The program's view, and the milliseconds it took on all cores."""


class PlaneViews:
    """Of cameras on a plane; where they are turned, their pictures are turned back."""

    def __init__(
        self,
        trial: Trial,
        photo: FloatImage,
        disparity: FloatImage,
        qualities: tuple[Quality, ...],
        max_pixels: int,
        stages: Stages,
    ) -> None:
        self.qualities, self._trial, self._photo, self._max_pixels = qualities, trial, photo, max_pixels
        self.offsets = [trial.offset(index) for index in trial.judged]
        self.maker = ViewMaker(photo, disparity, self.offsets, qualities, stages=stages)

    def __enter__(self) -> Self:
        """Complete the ray set."""
        self.maker.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.maker.__exit__(kind, error, trace)

    def truth(self, index: int) -> tuple[FloatImage, Mask]:
        """See `TrialViews`."""
        return read_straight_view(self._trial.scene.views[index], self._max_pixels)

    def warp(self, disparity: FloatImage, index: int) -> WarpedView:
        """See `TrialViews`."""
        return reference_warp(self._photo, disparity, self._trial.offset(index))

    def timed_view(self, quality: Quality, index: int) -> tuple[RenderedView, float]:
        """See `TrialViews`."""
        return self.maker.timed_view(quality, self._trial.offset(index))


class FreeCameraViews:
    """Of cameras that stand freely: views are made for them as they are, in closed form."""

    qualities: tuple[Quality, ...] = ("fast",)

    def __init__(
        self,
        trial: Trial,
        photo: FloatImage,
        disparity: FloatImage,
        max_pixels: int,
        stages: Stages,
    ) -> None:
        self._trial, self._photo, self._max_pixels = trial, photo, max_pixels
        self._given = self._camera(trial.given).resized(image_size(photo))
        # Cameras are in view steps: a step at distance 1 is the focal length.
        self._scale_px = self._given.focal_px[0]
        self._least_px = LEAST_STATED_SHARE * self._scale_px / (self._given.depth_range or (1.0, 1.0))[1]
        cameras = [self._as_large_as_photo(self._camera(index)) for index in trial.judged]
        inverse_depth = np.maximum(disparity, np.float32(self._least_px)) / np.float32(self._scale_px)
        self._views = FreeViews(
            photo,
            inverse_depth.astype(np.float32),
            self._given,
            cameras,
            partial(fill_background, stages=stages),
            stages=stages,
        )

    def __enter__(self) -> Self:
        """Everything is there."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing is held."""

    def truth(self, index: int) -> tuple[FloatImage, Mask]:
        """As it was taken."""
        pixels = read_view(self._trial.scene.views[index], self._max_pixels)
        return pixels, np.ones(pixels.shape[:2], np.bool_)

    def warp(self, disparity: FloatImage, index: int) -> WarpedView:
        """See `TrialViews`."""
        camera = self._as_large_as_photo(self._camera(index))
        matrix = target_from_photo(self._given, camera, self._scale_px)
        return reference_warp_to(self._photo, np.maximum(disparity, np.float32(self._least_px)), matrix, camera.size)

    def timed_view(self, quality: Quality, index: int) -> tuple[RenderedView, float]:
        """See `TrialViews`."""
        start = time.perf_counter()
        view = self._views.view(self._as_large_as_photo(self._camera(index)))
        return view, 1e3 * (time.perf_counter() - start)

    def _camera(self, index: int) -> Camera:
        camera = self._trial.scene.views[index].camera
        assert camera is not None, "of scenes whose cameras are known"
        return camera

    def _as_large_as_photo(self, camera: Camera) -> Camera:
        """All pictures of a scene are of one size."""
        return camera.resized(image_size(self._photo))


def trial_views(
    trial: Trial,
    photo: FloatImage,
    disparity: FloatImage,
    qualities: Sequence[Quality],
    max_pixels: int,
    stages: Stages = ALL_STAGES,
) -> TrialViews:
    """Of the trial's scene. photo: (H, W, 3), the given view; disparity: (H, W), px per view step. stages: on."""
    if trial.scene.views[trial.given].camera is None:
        return PlaneViews(trial, photo, disparity, tuple(qualities), max_pixels, stages)
    return FreeCameraViews(trial, photo, disparity, max_pixels, stages)
