"""The views of a trial: the true ones, by the reference warp, and as the program makes them. The cameras of a scene
stand on a plane and look the same way, or freely.
"""

from __future__ import annotations

from functools import partial
from typing import Protocol

import numpy as np

from iibr_core.beyond.free_cameras import FreeViews
from iibr_core.beyond.free_view import target_from_photo
from iibr_core.evaluation.datasets import read_straight_view, read_view
from iibr_core.evaluation.metrics import Mask
from iibr_core.evaluation.reference_warp import WarpedView, reference_warp, reference_warp_to
from iibr_core.evaluation.trials import Trial
from iibr_core.inpainting.background import fill_background
from iibr_core.method.photo_views import PhotoViews
from iibr_core.method.view import View
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import (
    Camera,
    FloatImage,
    image_size,
)

MIN_STATED_SHARE = 0.1
"""Smallest disparity as a share of the least one that the data set states: estimates below it are moved there."""


class TrialViews(Protocol):
    """Makes the judged views of a trial, by their index in the scene."""

    def truth(self, index: int) -> tuple[FloatImage, Mask]:
        """Return the true colours (H, W, 3) of a view, and where they are known (H, W)."""

    def warp(self, disparity: FloatImage, index: int) -> WarpedView:
        """Return the reference warp by a disparity (H, W)."""

    def view(self, index: int) -> View:
        """Return the program's view."""


class PlaneViews:
    """Views of cameras on a plane; if these are turned, their pictures are turned back."""

    def __init__(self, trial: Trial, photo: FloatImage, disparity: FloatImage, max_pixels: int, stages: Stages) -> None:
        self._trial, self._photo, self._max_pixels = trial, photo, max_pixels
        self.offsets = [trial.offset(index) for index in trial.judged]
        self.made = PhotoViews(photo, disparity, self.offsets, stages)

    def truth(self, index: int) -> tuple[FloatImage, Mask]:
        """See `TrialViews`."""
        return read_straight_view(self._trial.scene.views[index], self._max_pixels)

    def warp(self, disparity: FloatImage, index: int) -> WarpedView:
        """See `TrialViews`."""
        return reference_warp(self._photo, disparity, self._trial.offset(index))

    def view(self, index: int) -> View:
        """See `TrialViews`."""
        return self.made.view(self._trial.offset(index))


class FreeCameraViews:
    """Views of cameras that stand freely: they are made for them as they are, in closed form."""

    def __init__(self, trial: Trial, photo: FloatImage, disparity: FloatImage, max_pixels: int, stages: Stages) -> None:
        self._trial, self._photo, self._max_pixels = trial, photo, max_pixels
        self._given = self._camera(trial.given).resized(image_size(photo))
        # Cameras are in view steps: a step at distance 1 is the focal length.
        self._scale_px = self._given.focal_px[0]
        self._least_px = MIN_STATED_SHARE * self._scale_px / (self._given.depth_range or (1.0, 1.0))[1]
        cameras = [self._as_large_as_photo(self._camera(index)) for index in trial.judged]
        inverse_depth = np.maximum(disparity, np.float32(self._least_px)) / np.float32(self._scale_px)
        inpaint = partial(fill_background, stages=stages)
        self._views = FreeViews(photo, inverse_depth.astype(np.float32), self._given, cameras, inpaint, stages=stages)

    def truth(self, index: int) -> tuple[FloatImage, Mask]:
        """Return the picture as it was taken."""
        pixels = read_view(self._trial.scene.views[index], self._max_pixels)
        return pixels, np.ones(pixels.shape[:2], np.bool_)

    def warp(self, disparity: FloatImage, index: int) -> WarpedView:
        """See `TrialViews`."""
        camera = self._as_large_as_photo(self._camera(index))
        matrix = target_from_photo(self._given, camera, self._scale_px)
        return reference_warp_to(self._photo, np.maximum(disparity, np.float32(self._least_px)), matrix, camera.size)

    def view(self, index: int) -> View:
        """See `TrialViews`."""
        return self._views.view(self._as_large_as_photo(self._camera(index)))

    def _camera(self, index: int) -> Camera:
        camera = self._trial.scene.views[index].camera
        assert camera is not None, "of scenes whose cameras are known"
        return camera

    def _as_large_as_photo(self, camera: Camera) -> Camera:
        """All pictures of a scene are of one size."""
        return camera.resized(image_size(self._photo))


def trial_views(
    trial: Trial, photo: FloatImage, disparity: FloatImage, max_pixels: int, stages: Stages = ALL_STAGES
) -> TrialViews:
    """Return the views of a trial. photo (H, W, 3): the given view. disparity (H, W): in px per view step."""
    makes = PlaneViews if trial.scene.views[trial.given].camera is None else FreeCameraViews
    return makes(trial, photo, disparity, max_pixels, stages)
