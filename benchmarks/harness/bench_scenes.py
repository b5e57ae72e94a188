"""Scenes to measure with: drawn, of evaluation data, photos; each a photo with its disparity, and views to judge by."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.scenes import Trial, find_scenes, read_view, trial_input, trials_of
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.views import grid_of, read_stored_view
from iibr_core.formats.maps.writer import write_map
from iibr_core.method.plan import plan_for_viewing
from iibr_core.runtime.resources import resource_folder
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import (
    Disparity,
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    Photo,
    ViewOffset,
)

DEMO = resource_folder("assets") / "motorcycle" / "motorcycle.png"
FIELD = GridShape(9, 9)
CENTRE = ViewOffset(0.0, 0.0)
MOST_JUDGED = 12
JUDGED_SHARES = ((1.0, 1.0), (0.75, 0.25), (0.25, 0.75))
"""Places of the judged views, as shares of the way to the outermost row and column, in all four quarters."""
SOFT_PX = 2.0
"""Sigma by which true maps are blurred to be as soft at edges as estimated ones, in pixels."""
TEXTURE_PX = 1.5
SQUARE_SHARE = 0.09
"""Side of a square, as a share of the picture's."""
BAND = 256
"""Rows of a photo that are written at once."""


@dataclass(frozen=True, eq=False)
class BenchScene:
    """A field to make: photo (H, W, 3), disparity (H, W), true views by offset, offsets of every view of the field.

    is_soft: whether the disparity was blurred.
    """

    name: str
    photo: FloatImage
    disparity: FloatImage
    truth: Mapping[ViewOffset, FloatImage]
    field: tuple[ViewOffset, ...]
    is_soft: bool = False

    @property
    def reach(self) -> int:
        """Views from the centre to the side."""
        return int(max(abs(part) for at in self.field for part in at))

    @property
    def grid(self) -> GridShape:
        """Rows and columns of views."""
        return GridShape(len({at.t for at in self.field}), len({at.s for at in self.field}))

    @property
    def given(self) -> tuple[Photo, Disparity]:
        """Photo and disparity as the core takes them."""
        return Photo(self.photo, float(self.photo.shape[1]), self.name), Disparity(self.disparity, "bench")


def offsets_of(grid: GridShape) -> tuple[ViewOffset, ...]:
    """Return the offsets of every view."""
    return tuple(grid.offset(*at) for at in np.ndindex(*grid))


def data_scenes(data: Path | None, with_soft: bool = True) -> Iterator[BenchScene]:
    """The scenes of a folder that have disparity, each also with a soft map; none without a folder."""
    for known in find_scenes(data) if data else ():
        if known.disparity:
            yield from bench_scenes(known, DEFAULT_MAX_PIXELS, with_soft)


def bench_scenes(scene: MultiView, max_pixels: int, with_soft: bool = True) -> list[BenchScene]:
    """The scene with its own disparity, and with that made soft. Raises InputError where it has none or is no grid."""
    trial = trials_of(scene, "given", None)[0]
    given = trial_input(trial, "given", DepthChoice(), max_pixels)
    offsets = {index: trial.offset(index) for index in trial.judged}
    side = 2 * max(round(max(abs(part) for part in at)) for at in offsets.values()) + 1
    truth = {offsets[k]: read_view(scene.views[k], max_pixels) for k in _evenly_spaced(trial)}
    own = BenchScene(
        scene.name, given.photo, next(iter(given.maps.values())).values, truth, offsets_of(GridShape(side, side))
    )
    return [own, soften(own)] if with_soft else [own]


def soften(scene: BenchScene) -> BenchScene:
    """The scene with its disparity blurred."""
    return replace(scene, name=f"{scene.name}, soft map", disparity=_blur(scene.disparity, SOFT_PX), is_soft=True)


def _blur(image: NDArray[Any], sigma_px: float) -> FloatImage:
    """Return an image (H, W), blurred by OpenCV: importing torch would count as time and memory of the program."""
    return np.asarray(cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma_px), np.float32)


def _evenly_spaced(trial: Trial) -> list[int]:
    """Judged views: the corners, and eight between that fields with views left out do not store; all of few."""
    if len(trial.judged) <= MOST_JUDGED:
        return list(trial.judged)
    at = {k: np.array(trial.offset(k)) for k in trial.judged}
    low, high = np.min(list(at.values()), axis=0), np.max(list(at.values()), axis=0)
    wanted = [(a * t, b * s) for a, b in JUDGED_SHARES for t in (low[0], high[0]) for s in (low[1], high[1])]
    return list(dict.fromkeys(min(at, key=lambda k: float(np.hypot(*(at[k] - place)))) for place in wanted))


def judged_of(grid: GridShape) -> list[ViewOffset]:
    """The views of a drawn field that are judged."""
    t, s = grid.centre
    signs = [(a, b) for a in (-1, 1) for b in (-1, 1)]
    return [ViewOffset(t * down * a, s * across * b) for down, across in JUDGED_SHARES for a, b in signs]


def drawn_scene(
    seed: int, size: ImageSize, largest_px: float, grid: GridShape = FIELD, judged: Iterable[ViewOffset] = ()
) -> BenchScene:
    """A scene as training draws them, of true disparity up to largest_px, with its true views at the judged offsets."""
    scene = random_scene(np.random.default_rng(seed), size, largest_px)
    truth = {at: render(scene, size, at)[0] for at in judged}
    name = f"drawn {seed}, {size}, {grid.columns}x{grid.rows}"
    return BenchScene(name, *render(scene, size, CENTRE), truth, offsets_of(grid))


def squares_scene(side: int, range_px: float, squares: int, grid: GridShape = FIELD) -> BenchScene:
    """A textured wall of side x side px at 0, textured squares before it at range_px / 2 and more."""
    rng = np.random.default_rng(0)
    pixels = np.stack([_blur(rng.random((side, side)), TEXTURE_PX) for _ in range(3)], axis=-1)
    pixels = np.clip(0.5 + 2 * (pixels - 0.5), 0, 1).astype(np.float32)
    disparity = np.zeros((side, side), np.float32)
    length = max(round(SQUARE_SHARE * side), 1)
    for _ in range(squares):
        y, x = rng.integers(0, side - length + 1, 2)
        square = np.s_[y : y + length, x : x + length]
        disparity[square] = range_px * rng.uniform(0.5, 1.0)
        pixels[square] = pixels[square] * rng.uniform(0.3, 1.0, 3).astype(np.float32)
    name = f"{squares} squares, {side} px, {grid.columns}x{grid.rows}"
    return BenchScene(name, pixels, disparity, {}, offsets_of(grid))


def photo_scene(
    path: Path = DEMO, choice: DepthChoice | None = None, max_pixels: int = DEFAULT_MAX_PIXELS
) -> BenchScene | None:
    """Return a photo with the field that its plan gives it; None if its depth is no measured one but estimated."""
    found = open_with_depth(path, choice or DepthChoice(), max_pixels)
    if found.origin.kind not in ("file", "embedded"):
        return None
    plan = plan_for_viewing(found.photo, found.disparity)
    name = f"{path.name}, {found.photo.size}, {plan.grid.columns}x{plan.grid.rows}"
    return BenchScene(name, found.photo.pixels, plan.field_disparity(found.disparity).values, {}, offsets_of(plan.grid))


def read_views(data: Path) -> NDArray[np.uint8]:
    """The views of a light field of any layout, (V, U, H, W, 3)."""
    scene = open_light_field(data)
    grid = grid_of(scene)
    views = np.stack([read_stored_view(scene, *at) for at in np.ndindex(*grid)])
    return views.reshape(*grid, *views.shape[1:])


def write_photo(path: Path, size: tuple[int, int], seed: int = 0, with_map: bool = True) -> Path:
    """Write a photo of a (height, width), and its map, a quarter as wide, beside it: slopes and noise, a near square
    before them; nothing that compresses as no photo does. Band by band: large photos take no memory. Return path.
    """
    height, width = size
    rng = np.random.default_rng(seed)
    noise = rng.integers(0, 40, (BAND, width, 3), np.uint8)
    top, left = (rng.random(2) * (height / 2, width / 2)).astype(int)
    output = oiio.ImageOutput.create(str(path))
    output.open(str(path), oiio.ImageSpec(width, height, 3, "half" if path.suffix == ".exr" else "uint8"))
    across = np.linspace(0, 200, width)[:, None]
    for first in range(0, height, BAND):
        rows = np.arange(first, min(first + BAND, height))
        slope = 0.5 * (across + 200 * rows[:, None, None] / height) * (1.0, 0.8, 0.6)
        band = slope.astype(np.uint8) + noise[: len(rows)]
        band[(rows >= top) & (rows < top + height // 2), left : left + width // 2] //= 2
        output.write_scanlines(first, int(rows[-1]) + 1, 0, band)
    output.close()
    if with_map:
        disparity = np.full((max(height // 4, 1), max(width // 4, 1)), 0.5, np.float32)
        disparity[top // 4 : (top + height // 2) // 4, left // 4 : (left + width // 2) // 4] = 2.0
        write_map(path.with_name(f"{path.stem}_disparity.pfm"), disparity)
    return path


def require_scenes(data: Path, scenes: list[BenchScene]) -> list[BenchScene]:
    """The scenes. Raises InputError where there are none."""
    if not scenes:
        raise InputError(
            f"{data}: holds no scene with disparity; give one, such as views/v00_u00.png and gt_disp_*.npy"
        )
    return scenes
