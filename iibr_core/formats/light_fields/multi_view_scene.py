"""Several pictures of one scene whose viewpoints are known, on disk: a light field, or photos that stand on no grid.

The readers of the layouts return these records; `views.py` reads the pixels.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import entries_of
from iibr_core.formats.images.picture_source import PictureSource, shown_size
from iibr_core.types import Camera, GridShape, ImageSize, InputError, ViewOffset

PICTURE_EXTENSIONS = (".png", ".jpg", ".jpeg", ".ppm", ".exr", ".tif", ".tiff", ".bmp", ".webp")
"""Endings of views; the first one counts where a view exists in several kinds."""
MAP_EXTENSIONS = (".pfm", ".npy", ".exr", ".png", ".pgm")
"""Endings of disparity maps; the first one counts where a map exists in several kinds."""
MAX_VIEWS = 10_000

UPRIGHT_AXES = {
    1: ((1, 0), (0, 1)), 2: ((1, 0), (0, -1)), 3: ((-1, 0), (0, -1)), 4: ((-1, 0), (0, 1)),
    5: ((0, 1), (1, 0)), 6: ((0, 1), (-1, 0)), 7: ((0, -1), (-1, 0)), 8: ((0, -1), (1, 0)),
}  # fmt: skip
"""Steps down and to the right, as shown, of one step down and one to the right as stored, by Exif's orientation."""

GridIndex = tuple[int, int]
"""Row and column of a view on a grid, (v, u): rows downwards, columns to the right, both from 0."""


@dataclass(frozen=True, eq=False)
class KnownView:
    """One picture.

    name: label for people ("v00 u08"). offset: viewpoint (t, s) in view steps, from any origin. camera: the camera
    that took it, in view steps and by the axes of the central view's camera; None where all cameras look the same way
    from a plane. place: its place on the scene's grid, None where the scene has none.
    """

    name: str
    offset: ViewOffset
    picture: PictureSource
    camera: Camera | None = None
    place: GridIndex | None = None

    @property
    def path(self) -> Path:
        """File that the picture is in."""
        return self.picture.path


@dataclass(frozen=True)
class KnownDisparity:
    """A map on disk. scale: px per view step of one stored unit. is_truth: measured or rendered, not estimated."""

    path: Path
    scale: float = 1.0
    is_truth: bool = True


@dataclass(frozen=True, eq=False)
class MultiView:
    """The pictures of one scene.

    layout: the recognised layout, for people. disparity: maps by index into `views`. range_px: least and greatest
    disparity (px per view step) where the data set states them. notes: sentences for readers of figures. stated_centre:
    index of the central view, None where it follows from the viewpoints. grid: rows and columns that the views fill,
    None where they fill none. focal_px: focal length in pixels of a view; infinity_px: disparity of infinitely far
    points, px per view step; both where the data set states them. numbers: row and column in the name of each view, or
    its number in one order, counted from 0; none where the layout is sure of the places. stated_grid: grid of numbered
    views that a file states. is_guess: whether they are numbered as photos of a holiday may be. is_stated: whether the
    layout states the order of its numbers, so that it holds unless parallax clearly shows another.
    """

    name: str
    layout: str
    views: tuple[KnownView, ...]
    disparity: Mapping[int, KnownDisparity] = field(default_factory=dict)
    range_px: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    stated_centre: int | None = None
    grid: GridShape | None = None
    focal_px: float | None = None
    infinity_px: float | None = None
    numbers: tuple[tuple[int, ...], ...] = ()
    stated_grid: GridShape | None = None
    is_guess: bool = False
    is_stated: bool = False

    @property
    def centre(self) -> int:
        """Index of the central view, stated or nearest to the middle of the box around all viewpoints."""
        if self.stated_centre is not None:
            return self.stated_centre
        ts, ss = ([view.offset[axis] for view in self.views] for axis in (0, 1))
        return nearest_view(self.views, ViewOffset((min(ts) + max(ts)) / 2, (min(ss) + max(ss)) / 2))

    @property
    def place(self) -> Path:
        """File that holds all views, or folder of the first view."""
        files = {view.path for view in self.views}
        return files.pop() if len(files) == 1 and len(self.views) > 1 else self.views[0].path.parent

    @property
    def is_hdr(self) -> bool:
        """True if a view holds linear light, which may exceed white."""
        return any(view.path.suffix.lower() == ".exr" for view in self.views)


def nearest_view(views: Sequence[KnownView], to: ViewOffset) -> int:
    """Return the index of the view nearest to a viewpoint.

    Among equals the lower right one is taken, as for the centre of an even grid; of a pair always the first.
    """
    if len(views) == 2:
        return 0

    def distance(index: int) -> tuple[float, float, float]:
        at = views[index].offset
        return round((at.t - to.t) ** 2 + (at.s - to.s) ** 2, 9), -at.t, -at.s

    return min(range(len(views)), key=distance)


def common_size(views: Sequence[KnownView]) -> ImageSize:
    """Return the size of all views, upright, read from their headers."""
    sizes = {view.picture: shown_size(view.picture) for view in views}
    first = views[0].picture
    for picture, size in sizes.items():
        if size != sizes[first]:
            number = f", picture {picture.number}" if picture.number > 0 else ""
            raise InputError(f"{picture.path}{number}: is {size}, but {first.path.name} is {sizes[first]}")
    return sizes[first]


def place_on_grid(scene: MultiView, numbers: Sequence[GridIndex]) -> MultiView:
    """Return the scene with its views placed on a grid; unchanged if the numbers fill none.

    numbers: row and column of each view as the layout counts them. They may begin anywhere and have a constant step, as
    where every second view was kept.
    """
    rows, columns = (sorted(set(axis)) for axis in zip(*numbers))
    is_even = all(len({b - a for a, b in pairwise(axis)}) <= 1 for axis in (rows, columns))
    if not is_even or not len(rows) * len(columns) == len(set(numbers)) == len(numbers):
        return scene
    places = [(rows.index(row), columns.index(column)) for row, column in numbers]
    views = tuple(replace(view, place=place) for view, place in zip(scene.views, places))
    return replace(scene, views=views, grid=GridShape(len(rows), len(columns)))


def grid_of_every(grid: GridShape, every: int) -> GridShape:
    """Return the grid of every n-th row and column from the middle."""
    return GridShape(*(len(range(length // 2 % every, length, every)) for length in grid))


def thinned(scene: MultiView, every: int) -> MultiView:
    """Return a scene with every n-th row and column of its grid, the middle ones among them, and a note."""
    if every == 1 or scene.grid is None:
        return scene
    places = [view.place or (0, 0) for view in scene.views]
    kept = [k for k, at in enumerate(places) if all(n % every == m // 2 % every for n, m in zip(at, scene.grid))]
    views = tuple(replace(scene.views[k], place=(places[k][0] // every, places[k][1] // every)) for k in kept)
    numbers = [scene.numbers[k] if len(scene.numbers[k]) == 2 else places[k] for k in kept if scene.numbers]
    ranks = [sorted(set(axis)) for axis in zip(*numbers)]
    grid = grid_of_every(scene.grid, every)
    words, part = (f"{shape.columns}x{shape.rows}" for shape in (scene.grid, grid))
    return replace(
        scene,
        layout=scene.layout.replace(words, f"{part} of {words}"),
        views=views,
        grid=grid,
        disparity={new: scene.disparity[old] for new, old in enumerate(kept) if old in scene.disparity},
        numbers=tuple((ranks[0].index(v), ranks[1].index(u)) for v, u in numbers),
        stated_grid=None,
        stated_centre=None,
        notes=(*scene.notes, f"One of every {every} rows and columns of views is used: {part} of {words}."),
    )


def turned_upright(scene: MultiView, orientation: int) -> MultiView:
    """Return a scene whose viewpoints lie along the axes of the pictures as stored, along those as shown.

    orientation: Exif's, of all its pictures.
    """
    down, right = UPRIGHT_AXES[orientation]

    def turn(at: tuple[float, float]) -> tuple[float, float]:
        return down[0] * at[0] + down[1] * at[1], right[0] * at[0] + right[1] * at[1]

    if scene.grid is None or orientation == 1:
        return scene
    places = [turn(view.place) for view in scene.views if view.place is not None]
    least, rows_columns = [min(axis) for axis in zip(*places)], [abs(n) for n in turn(scene.grid)]
    views = tuple(
        replace(view, offset=ViewOffset(*turn(view.offset)), place=(int(v - least[0]), int(u - least[1])))
        for view, (v, u) in zip(scene.views, places)
    )
    return replace(scene, views=views, grid=GridShape(*map(int, rows_columns)))


def line_numbers(values: NDArray[np.float64], min_gap: float) -> NDArray[np.int64]:
    """Return the number of the row or column of each view: places (N,) along an axis lie farther apart than `min_gap`
    in different ones.
    """
    order = np.argsort(values)
    numbers = np.zeros(len(values), np.int64)
    numbers[order[1:]] = np.cumsum(np.diff(values[order]) > min_gap)
    return numbers


def slope(x: NDArray[Any], y: NDArray[Any]) -> float:
    """Return the slope of the line fitted to (x, y), each (N,); 0 if all x are equal."""
    centred = x - x.mean()
    spread = float((centred**2).sum())
    return float((centred * y).sum() / spread) if spread > 0 else 0.0


def pictures_in(folder: Path) -> list[Path]:
    """Return the pictures directly in a folder, sorted by name."""
    pictures = [path for path in entries_of(folder) if path.suffix.lower() in PICTURE_EXTENSIONS and path.is_file()]
    if len(pictures) > MAX_VIEWS:
        raise InputError(
            f"{folder}: holds {len(pictures)} pictures, more than {MAX_VIEWS}; give the folder of one scene"
        )
    return pictures


def maps_in(folder: Path) -> dict[str, Path]:
    """Return the files of a folder that may be maps, by stem: the folder is listed once for the maps of all views."""
    return preferred_files((path for path in entries_of(folder) if path.is_file()), MAP_EXTENSIONS)


def preferred_files(files: Iterable[Path], extensions: Sequence[str]) -> dict[str, Path]:
    """Return the files of these kinds by stem; of files with one stem the kind that comes first in `extensions`."""
    kinds = [path for path in files if path.suffix.lower() in extensions]
    return {path.stem: path for path in sorted(kinds, key=lambda path: -extensions.index(path.suffix.lower()))}
