"""Several pictures of one scene whose viewpoints are known, on disk: a light field, or photos that stand on no grid.

Readers of the layouts give these records; pixels are read when they are asked for (`views.py`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from iibr_core.formats.files import entries_of, is_file
from iibr_core.formats.images.picture_source import PictureSource, source_size
from iibr_core.types import Camera, GridShape, ImageSize, InputError, ViewOffset

PICTURE_EXTENSIONS = (".png", ".jpg", ".jpeg", ".ppm", ".exr", ".tif", ".tiff", ".bmp", ".webp")
MAP_EXTENSIONS = (".pfm", ".npy", ".exr", ".png", ".pgm")
MOST_VIEWS = 10_000
"""A folder with more pictures is taken for something else."""

GridIndex = tuple[int, int]
"""Row and column of a view on a grid, (v, u): rows downwards, columns to the right, both from 0."""


@dataclass(frozen=True, eq=False)
class KnownView:
    """One picture. offset: its viewpoint (t, s) in view steps, from any origin. picture: where its pixels are.

    camera: that took it, in view steps and by the axes of the given view's, where cameras stand freely; None where all
    look the same way from a plane. name: for people ("v00 u08"). place: on the scene's grid,
    None where it has none.
    """

    name: str
    offset: ViewOffset
    picture: PictureSource
    camera: Camera | None = None
    place: GridIndex | None = None

    @property
    def path(self) -> Path:
        """The file that it is in."""
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

    layout: what the folder was recognised as. disparity: maps by index into `views`. range_px: least and greatest
    disparity (px per view step) where the data set states them. notes: what a reader of figures should know.
    stated_centre: index of the view in the middle, None where their viewpoints tell. grid: the rows and columns that
    the views fill, each in its `place`, None where they fill none. focal_px: focal length in pixels of a view, where
    the data set states it.
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

    @property
    def centre(self) -> int:
        """Index of the view in the middle, stated or nearest to it."""
        if self.stated_centre is not None:
            return self.stated_centre
        return nearest_view(self.views, middle(self.views))

    @property
    def place(self) -> Path:
        """The file that all views are in, or the folder that the first one's file is in."""
        files = {view.path for view in self.views}
        return files.pop() if len(files) == 1 and len(self.views) > 1 else self.views[0].path.parent

    @property
    def is_hdr(self) -> bool:
        """Whether any view holds linear light, which may exceed white."""
        return any(view.path.suffix.lower() == ".exr" for view in self.views)


def middle(views: tuple[KnownView, ...]) -> ViewOffset:
    """The middle of the box around all viewpoints."""
    ts, ss = [view.offset.t for view in views], [view.offset.s for view in views]
    return ViewOffset((min(ts) + max(ts)) / 2, (min(ss) + max(ss)) / 2)


def nearest_view(views: tuple[KnownView, ...], to: ViewOffset) -> int:
    """Index of the view nearest to a viewpoint; of equals the one farther down and right, as an even grid's centre, but
    of a pair the first.
    """
    if len(views) == 2:
        return 0

    def distance(index: int) -> tuple[float, float, float]:
        at = views[index].offset
        return round((at.t - to.t) ** 2 + (at.s - to.s) ** 2, 9), -at.t, -at.s

    return min(range(len(views)), key=distance)


def pictures_in(folder: Path) -> list[Path]:
    """The pictures directly in a folder, by name. Raises InputError if it cannot be read or holds too many."""
    found = [path for path in entries_of(folder) if path.suffix.lower() in PICTURE_EXTENSIONS and is_file(path)]
    if len(found) > MOST_VIEWS:
        raise InputError(f"{folder}: holds {len(found)} pictures, more than {MOST_VIEWS}; give the folder of one scene")
    return found


def common_size(views: Sequence[KnownView]) -> ImageSize:
    """Of all views, from their headers. Raises InputError for one of another size than the first."""
    sizes = {view.picture: source_size(view.picture) for view in views}
    first = views[0].picture
    for picture, size in sizes.items():
        if size != sizes[first]:
            shown, other = f"{picture.path}{_numbered(picture)}", f"{first.path.name}{_numbered(first)}"
            raise InputError(f"{shown}: is {size}, but {other} is {sizes[first]}")
    return sizes[first]


def _numbered(picture: PictureSource) -> str:
    """Behind the name of a picture's file, for people."""
    return f", picture {picture.number}" if picture.number > 0 else ""


def on_grid(scene: MultiView, numbers: Sequence[GridIndex]) -> MultiView:
    """The scene with its views in their places on a grid; unchanged where their numbers of row and column fill none.

    Numbers may begin anywhere and go in steps, equal ones, as where every second view was kept.
    """
    rows, columns = (sorted(set(axis)) for axis in zip(*numbers))
    is_even = all(len({b - a for a, b in pairwise(axis)}) <= 1 for axis in (rows, columns))
    if not is_even or not len(rows) * len(columns) == len(set(numbers)) == len(numbers):
        return scene
    places = [(rows.index(row), columns.index(column)) for row, column in numbers]
    views = tuple(replace(view, place=place) for view, place in zip(scene.views, places))
    return replace(scene, views=views, grid=GridShape(len(rows), len(columns)))


def maps_in(folder: Path) -> dict[str, Path]:
    """What may be maps in a folder, by stem; of several kinds the one that comes first among MAP_EXTENSIONS.

    One look at the folder: the maps of 81 views may have 1,600 names, and asking for each took longer than all else.
    """
    files = [path for path in entries_of(folder) if path.suffix.lower() in MAP_EXTENSIONS]
    by_preference = sorted(files, key=lambda path: MAP_EXTENSIONS.index(path.suffix.lower()), reverse=True)
    return {path.stem: path for path in by_preference}


def first_map(maps: Mapping[str, Path], *stems: str) -> Path | None:
    """The first file of these names, of what `maps_in` found."""
    return next((maps[stem] for stem in stems if stem in maps and is_file(maps[stem])), None)


def numbers_in(name: str) -> tuple[int, ...]:
    """The runs of digits in a name."""
    return tuple(int(digits) for digits in re.findall(r"\d{1,9}", name))
