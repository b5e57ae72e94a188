"""Scenes whose views are known, the paper's trials on them, and the photo and disparity of a trial.

The trials: from the centre view to all others, and on grids from the bottom left to the top left one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from iibr_core.beyond.free_view import target_from_photo
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import PhotoWithDepth, open_with_depth
from iibr_core.evaluation.alignment import ViewFit
from iibr_core.evaluation.warp import WarpedView, reference_warp, reference_warp_to
from iibr_core.formats.files import entries_of
from iibr_core.formats.images.photo import read_picture
from iibr_core.formats.light_fields.light_field_formats import LAYOUTS, find_light_field
from iibr_core.formats.light_fields.multi_view_scene import KnownDisparity, KnownView, MultiView, common_size
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.inpainting.disparity_holes import fill_disparity_holes
from iibr_core.types import Camera, Disparity, FloatImage, GridShape, ImageSize, InputError, ViewOffset, image_size

DisparityFrom = Literal["given", "estimate"]
"""Origin of the given view's disparity: the scene's map, or the program's estimate from the photo alone."""
CENTRE_TRIAL, CORNER_TRIAL = "centre to all others", "bottom left to top left"
FITTED = ", fitted"
"""End of the kind of a map at its best scale and shift."""
ESTIMATES = {"embedded": "photo's own depth", "rough": "guess"}
"""Kinds of estimates by their origin, where the two differ."""
FITTED_VIEWS = 4
"""Number of true views, the farthest, that a map's best scale and shift are found with."""


def read_scene(folder: Path) -> MultiView | None:
    """Return the scene of a folder, None if its layout is unknown.

    Raises InputError if it is damaged, has one view only, or views of different sizes.
    """
    scene = find_light_field(folder)
    if scene is None:
        return None
    if len(scene.views) < 2:
        raise InputError(f"{scene.views[0].path}: is the only view; a comparison needs at least two")
    common_size(scene.views)
    return scene


def find_scenes(folder: Path) -> Iterator[MultiView]:
    """Yield the scene of a folder, or those of its subfolders. Raises InputError if there is none or one is damaged."""
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; give the folder of a data set ({LAYOUTS})")
    below = (path for path in entries_of(folder) if path.is_dir() and not path.name.startswith("."))
    scene = read_scene(folder)
    found = [scene] if scene else [scene for path in below if (scene := read_scene(path))]
    if not found:
        raise InputError(f"{folder}: holds no scene with several views; laid out as {LAYOUTS}")
    yield from found


def read_view(view: KnownView, max_pixels: int) -> FloatImage:
    """Return colours (H, W, 3), sRGB-encoded in 0..1."""
    return np.clip(read_picture(view.picture, max_pixels).pixels, 0, 1)


@dataclass(frozen=True, eq=False)
class Trial:
    """given: index of the view that is known. judged: indices of the views that are compared."""

    name: str
    scene: MultiView
    given: int
    judged: tuple[int, ...]

    def offset(self, index: int) -> ViewOffset:
        """Return the viewpoint of a view, from the given one."""
        at, origin = self.scene.views[index].offset, self.scene.views[self.given].offset
        return ViewOffset(at.t - origin.t, at.s - origin.s)

    @property
    def is_free(self) -> bool:
        """True if cameras are turned or stand off the plane of the given one."""
        return self.scene.views[self.given].camera is not None

    def camera(self, index: int, size: ImageSize) -> Camera:
        """Return the camera of a view of a free trial, with pictures of a size."""
        camera = self.scene.views[index].camera
        assert camera is not None
        return camera.resized(size)


def trials_of(scene: MultiView, source: DisparityFrom | Path, max_views: int | None = None) -> list[Trial]:
    """Return the trials of a scene. max_views: most views that are judged, evenly spread, with the farthest."""
    centre = scene.centre if source == "estimate" else _mapped_centre(scene)
    others = [index for index in range(len(scene.views)) if index != centre]
    if max_views is not None and max_views < len(others):
        others = [others[round(k)] for k in np.linspace(0, len(others) - 1, max_views)]
    trials = [Trial(CENTRE_TRIAL, scene, centre, tuple(others))]
    places = np.array([view.offset for view in scene.views])
    (top, left), (bottom, right) = places.min(axis=0), places.max(axis=0)
    if not trials[0].is_free and bottom - top >= 0.5 and right - left >= 0.5:
        given, judged = (int(np.hypot(*(places - corner).T).argmin()) for corner in ((bottom, left), (top, left)))
        trials.append(Trial(CORNER_TRIAL, scene, given, (judged,)))
    return trials


def _mapped_centre(scene: MultiView) -> int:
    """Return the index of the view with a map that is nearest to the centre; true maps come first."""
    if scene.centre in scene.disparity or not scene.disparity:
        return scene.centre
    at = scene.views[scene.centre].offset
    truths = {index for index, known in scene.disparity.items() if known.is_truth} or set(scene.disparity)
    return min(truths, key=lambda k: (scene.views[k].offset.t - at.t) ** 2 + (scene.views[k].offset.s - at.s) ** 2)


@dataclass(frozen=True, eq=False)
class TrialInput:
    """The start of a trial.

    photo: (H, W, 3), sRGB-encoded in 0..1. maps: disparities to make views with, by their kind. judge: (H, W), the
    disparity that separates holes from visible parts. fit: finds the plane, scale and shift nearest to true views.
    """

    photo: FloatImage
    maps: Mapping[str, Disparity]
    judge: Disparity
    fit: ViewFit


def trial_input(trial: Trial, source: DisparityFrom | Path, choice: DepthChoice, max_pixels: int) -> TrialInput:
    """Return the given view of a trial and its disparity. source: a file is the centre view's map.

    A true map comes alone. Another map, and an estimate, comes at its own scale and fitted: at the scale and shift that
    bring its views nearest to the true ones. With an estimate come a fitted guess and the true map if there is one.
    Raises InputError if there is no disparity of the kind asked for, or it cannot be read.
    """
    scene, view = trial.scene, trial.scene.views[trial.given]
    photo = read_view(view, max_pixels)
    fit = _fit_of(trial, photo, max_pixels)
    known = {index: stored for index, stored in scene.disparity.items() if stored.is_truth}
    truth = _map_of(trial, known, max_pixels)
    maps = {} if truth is None else {"true map": truth}
    if source == "estimate":
        maps = _estimates(trial, choice, max_pixels, fit) | maps
    elif isinstance(source, Path) or truth is None:
        stored = {_mapped_centre(scene): KnownDisparity(source)} if isinstance(source, Path) else scene.disparity
        given = _map_of(trial, stored, max_pixels)
        if given is None:
            raise InputError(f"{view.path}: has no disparity map beside it; give a map, or have it estimated")
        maps = _with_fitted("given map", given, fit)
    judge = truth or next(disparity for kind, disparity in maps.items() if kind.endswith(FITTED))
    return TrialInput(photo, maps, judge, fit)


def _estimates(trial: Trial, choice: DepthChoice, max_pixels: int, fit: ViewFit) -> dict[str, Disparity]:
    """Return the program's estimate, and a fitted guess if that is not a guess already."""
    found = _estimate(trial, choice, max_pixels)
    kind = ESTIMATES.get(found.origin.kind, found.origin.kind)
    maps = _with_fitted(kind, found.disparity, fit)
    if kind != "guess":
        guess = _estimate(trial, replace(choice, start="rough", model=None), max_pixels).disparity
        maps[f"guess{FITTED}"] = _fitted(guess, fit)
    return maps


def _with_fitted(kind: str, disparity: Disparity, fit: ViewFit) -> dict[str, Disparity]:
    return {kind: disparity, f"{kind}{FITTED}": _fitted(disparity, fit)}


def _fitted(disparity: Disparity, fit: ViewFit) -> Disparity:
    return replace(disparity, values=fit.fitted(disparity.values))


def _map_of(trial: Trial, maps: Mapping[int, KnownDisparity], max_pixels: int) -> Disparity | None:
    """Return the given view's map, or the nearest view's carried over; None if there is none."""
    if not maps:
        return None
    views, nearest = trial.scene.views, min(maps, key=lambda index: sum(part**2 for part in trial.offset(index)))
    colors = read_view(views[nearest], max_pixels)
    stored = read_disparity(maps[nearest].path, image_size(colors), maps[nearest].scale, colors)
    if nearest == trial.given:
        return stored
    t, s = trial.offset(nearest)
    note = f"The disparity of {views[nearest].name} was carried over to {views[trial.given].name}."
    values = warp_disparity(stored.values, ViewOffset(-t, -s))
    return Disparity(values, f"{stored.source}, carried over", (*stored.notes, note))


def warp_disparity(disparity: FloatImage, offset: ViewOffset) -> FloatImage:
    """Return the disparity (H, W) of the view at an offset; hidden parts are filled from behind."""
    warped = reference_warp(np.zeros((*disparity.shape, 3), np.float32), disparity, offset)
    values = np.where(warped.hole, np.float32(np.nan), warped.disparity)
    return disparity if np.isnan(values).all() else fill_disparity_holes(values)


def _estimate(trial: Trial, choice: DepthChoice, max_pixels: int) -> PhotoWithDepth:
    """Return the depth that the program finds from the given view alone, unrefined."""
    reach = [round(2 * max(abs(trial.offset(k)[axis]) for k in trial.judged)) + 1 for axis in (0, 1)]
    start = "model" if choice.asks_for_model else "embedded" if choice.start == "auto" else choice.start
    alone = replace(choice, start=start, file=None, refine=False)
    return open_with_depth(trial.scene.views[trial.given].path, alone, max_pixels, GridShape(*reach))


def _fit_of(trial: Trial, photo: FloatImage, max_pixels: int) -> ViewFit:
    farthest = sorted(trial.judged, key=lambda k: -max(map(abs, trial.offset(k))))[:FITTED_VIEWS]
    truths = [(partial(_warped, trial, k), read_view(trial.scene.views[k], max_pixels)) for k in farthest]
    return ViewFit(photo, truths, max(map(abs, trial.offset(farthest[0]))))


def _warped(trial: Trial, index: int, photo: FloatImage, disparity: FloatImage) -> FloatImage:
    return warp_view(trial, photo, disparity, index).colors


def warp_view(trial: Trial, photo: FloatImage, disparity: FloatImage, index: int) -> WarpedView:
    """Return a view of the trial by the plain warp. photo: (H, W, 3). disparity: (H, W), px per view step."""
    if not trial.is_free:
        return reference_warp(photo, disparity, trial.offset(index))
    size = image_size(photo)
    given = trial.camera(trial.given, size)
    matrix = target_from_photo(given, trial.camera(index, size), given.focal_px[0])
    return reference_warp_to(photo, in_front(given, disparity), matrix, size)


def in_front(given: Camera, disparity: FloatImage) -> FloatImage:
    """Return disparity (H, W) of points in front of the camera, at most ten times as far as the data set states.

    Cameras are in view steps, so a step at distance 1 is the focal length.
    """
    farthest = (given.depth_range or (1.0, 1.0))[1]
    return np.maximum(disparity, np.float32(0.1 * given.focal_px[0] / farthest))
