"""Scenes whose true views are known, drawn or from a folder, and maps of every kind that a photo can come with."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from benchmarks.report import is_wanted
from iibr_core.color import stored_from_encoded
from iibr_core.depth.choice import DepthChoice, DepthStart
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.alignment import ViewFit
from iibr_core.evaluation.scenes import FITTED_VIEWS, read_view
from iibr_core.evaluation.warp import reference_warp
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import find_light_field
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.resample import resample_map
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import CENTRE, FloatImage, GridShape, ImageSize, InputError, ViewOffset

MAX_PIXELS = 150_000
"""Largest size of a photo, in pixels."""
DRAWN_SIZE = ImageSize(240, 320)
SIDES = [(t, s) for t in (-1, 0, 1) for s in (-1, 0, 1) if t or s]
"""Corners and middles of the sides, which are judged, in (down, right) from the centre."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A photo (H, W, 3), its disparity (H, W) in px per view step, and true views by viewpoint.

    field: viewpoints of all views of the light field. is_enlarged: whether the map was smaller than the photo.
    """

    name: str
    photo: FloatImage
    disparity: FloatImage
    truth: dict[ViewOffset, FloatImage]
    field: tuple[ViewOffset, ...]
    is_enlarged: bool = False


def drawn_scene(
    seed: int, size: ImageSize = DRAWN_SIZE, largest_px: float = 2.0, sides: Sequence[tuple[int, int]] = SIDES
) -> Scene:
    """Return a scene as training draws them, with disparities of at most `largest_px`."""
    scene = random_scene(np.random.default_rng(seed), size, largest_px)
    places = [ViewOffset(4.0 * t, 4.0 * s) for t, s in sides]
    truth = {at: render(scene, size, at)[0] for at in places}
    return Scene(f"drawn {seed}", *render(scene, size, CENTRE), truth, offsets_of(GridShape(9, 9)))


def offsets_of(grid: GridShape) -> tuple[ViewOffset, ...]:
    """Return the viewpoints of a grid."""
    return tuple(grid.offset(*place) for place in np.ndindex(*grid))


def data_scenes(data: Path, only: str = "", max_pixels: int = MAX_PIXELS) -> Iterator[Scene]:
    """Yield the scene of a folder or those of its subfolders that have a map and cameras on a plane."""
    folders = [data] if find_light_field(data) else sorted(path for path in data.iterdir() if path.is_dir())
    for folder in folders:
        known = find_light_field(folder)
        if known and known.disparity and known.views[0].camera is None and is_wanted(known.name, only):
            yield _read_scene(known, max_pixels)


def _read_scene(known: MultiView, max_pixels: int) -> Scene:
    """Return a scene seen from the view nearest to the centre that has a map, judged at corners and sides."""
    places = np.array([view.offset for view in known.views], np.float64)
    given = min(known.disparity, key=lambda k: float(np.hypot(*(places[k] - places[known.centre]))))
    places -= places[given]
    low, high = places.min(axis=0), places.max(axis=0)
    wanted = [[(low, (low + high) / 2, high)[part + 1][axis] for axis, part in enumerate(side)] for side in SIDES]
    others = [k for k in range(len(places)) if k != given]
    judged = dict.fromkeys(min(others, key=lambda k: float(np.hypot(*(places[k] - at)))) for at in wanted)
    photo, map_file = read_view(known.views[given], max_pixels), known.disparity[given]
    disparity = read_disparity(map_file.path, ImageSize(*photo.shape[:2]), map_file.scale, photo).values
    side = 2 * round(np.abs(places[list(judged)]).max()) + 1
    truth = {ViewOffset(*map(float, places[k])): read_view(known.views[k], max_pixels) for k in judged}
    return Scene(known.name, photo, disparity, truth, offsets_of(GridShape(side, side)))


def phone_map(scene: Scene) -> Scene:
    """Return the scene with a map like a phone's: a third of the size, 8 bits, soft."""
    step = max(float(np.ptp(scene.disparity)) / 255, 1e-6)
    small = np.rint(_smaller(scene.disparity, 1 / 3) / step) * step
    enlarged = cv2.resize(small, scene.disparity.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return replace(scene, disparity=_blur(enlarged, 1.0))


def network_like(exact: FloatImage, seed: int = 0) -> FloatImage:
    """Return a map (h, w) with a network's faults: no thin things, edges off by pixels, small and unevenly soft."""
    rng, (height, width) = np.random.default_rng(seed), exact.shape
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    values = cv2.morphologyEx(cv2.morphologyEx(exact, cv2.MORPH_OPEN, disc), cv2.MORPH_CLOSE, disc)
    rows, columns = np.indices((height, width), np.float32)
    down, right = (width / 250 * _waves(rng, values.shape) for _ in range(2))
    moved = cv2.remap(values, columns + right, rows + down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    small = _smaller(moved, 1 / 2)
    is_sharp = 1 / (1 + np.exp(-3 * _waves(rng, small.shape)))
    return np.asarray(is_sharp * _blur(small, 0.8) + (1 - is_sharp) * _blur(small, 2.0), np.float32)


def _waves(rng: np.random.Generator, shape: tuple[int, ...]) -> FloatImage:
    """Return smooth noise (H, W) of standard deviation 1."""
    noise = cv2.GaussianBlur(rng.normal(size=shape), (0, 0), shape[1] / 16)
    return np.asarray(noise / noise.std(), np.float32)


def _blur(values: FloatImage, sigma_px: float) -> FloatImage:
    return np.asarray(cv2.GaussianBlur(values, (0, 0), sigma_px), np.float32)


def _smaller(values: FloatImage, factor: float) -> FloatImage:
    height, width = (max(round(factor * length), 2) for length in values.shape)
    return np.asarray(cv2.resize(values, (width, height), interpolation=cv2.INTER_AREA), np.float32)


def at_photo_size(scene: Scene, small: FloatImage) -> Scene:
    """Return the scene with a map (h, w) enlarged as the program enlarges it."""
    values = resample_map(np.ascontiguousarray(small, np.float32), ImageSize(*scene.photo.shape[:2]))
    return replace(scene, disparity=values, is_enlarged=True)


def estimated_map(scene: Scene, start: DepthStart, model: Path | None = None) -> Scene:
    """Return the scene with a map estimated from the photo alone, at the best scale and shift for its true views."""
    estimate = estimate_disparity(scene.photo, start, model)
    return replace(scene, disparity=_fit_of(scene).fitted(estimate), is_enlarged=start == "model")


def estimate_disparity(photo: FloatImage, start: DepthStart, model: Path | None = None) -> FloatImage:
    """Return the disparity (H, W) that the program estimates for a photo without any map, not refined."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "photo.png")
        write_image(path, stored_from_encoded(photo, False))
        choice = DepthChoice(start=start, model=str(model) if model else None, refine=False)
        return open_with_depth(path, choice, photo[..., 0].size).disparity.values


def plane_map(scene: Scene) -> Scene:
    """Return the scene with one plane, where it comes nearest to the true views."""
    return replace(scene, disparity=np.full_like(scene.disparity, _fit_of(scene).plane))


def _fit_of(scene: Scene) -> ViewFit:
    offsets = list(scene.truth)[:FITTED_VIEWS]
    truths = [(partial(_warped, offset), scene.truth[offset]) for offset in offsets]
    return ViewFit(scene.photo, truths, max(max(abs(offset.t), abs(offset.s)) for offset in offsets))


def _warped(offset: ViewOffset, photo: FloatImage, disparity: FloatImage) -> FloatImage:
    return reference_warp(photo, disparity, offset).colors


MAPS: dict[str, Callable[[Scene], Scene]] = {
    "exact": lambda scene: scene,
    "soft": lambda scene: replace(scene, disparity=_blur(scene.disparity, 2.0)),
    "resampled": lambda scene: at_photo_size(scene, _smaller(scene.disparity, 224 / max(scene.disparity.shape))),
    "phone": phone_map,
    "network-like": lambda scene: at_photo_size(scene, network_like(scene.disparity)),
    "guess": lambda scene: estimated_map(scene, "rough"),
    "plane": plane_map,
}
"""Kinds of maps; `network` needs a model, too."""


def with_map(scene: Scene, kind: str, model: Path | None) -> Scene:
    """Return the scene with a map of a kind. Raises InputError for a kind that is unknown or needs a model."""
    if kind == "network":
        if model is None:
            raise InputError("maps of a network need --depth-model FILE")
        return estimated_map(scene, "model", model)
    if kind not in MAPS:
        raise InputError(f"{kind!r} is no kind of map; give some of {', '.join((*MAPS, 'network'))}")
    return MAPS[kind](scene)
