"""Several pictures of one scene whose viewpoints are known, on disk: what evaluation compares with.

Readers of the layouts give these records; pixels are read when they are asked for.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.images.oiio_reader import read_size
from iibr_core.types import InputError, ViewOffset

PICTURE_EXTENSIONS = (".png", ".jpg", ".jpeg", ".ppm", ".exr", ".tif", ".tiff", ".bmp", ".webp")
MAP_EXTENSIONS = (".pfm", ".npy", ".exr", ".png", ".pgm")
MOST_VIEWS = 10_000
"""A folder with more pictures is taken for something else."""


@dataclass(frozen=True, eq=False)
class KnownView:
    """One picture. offset: its viewpoint (t, s) in view steps, from any origin.

    turned: (3, 3), takes a pixel (x, y, 1) of the given view's frame to this picture's where cameras are turned
    against each other; None where all look the same way. name: for people ("v00 u08").
    """

    name: str
    offset: ViewOffset
    path: Path
    turned: NDArray[np.float64] | None = None


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
    stated_centre: index of the view in the middle, None where their viewpoints tell.
    """

    name: str
    layout: str
    views: tuple[KnownView, ...]
    disparity: Mapping[int, KnownDisparity] = field(default_factory=dict)
    range_px: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    stated_centre: int | None = None

    @property
    def centre(self) -> int:
        """Index of the view in the middle, stated or nearest to it."""
        if self.stated_centre is not None:
            return self.stated_centre
        return nearest_view(self.views, middle(self.views))


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
    try:
        found = sorted(p for p in folder.iterdir() if p.suffix.lower() in PICTURE_EXTENSIONS and p.is_file())
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({error.strerror}); give a folder with views") from error
    if len(found) > MOST_VIEWS:
        raise InputError(f"{folder}: holds {len(found)} pictures, more than {MOST_VIEWS}; give the folder of one scene")
    return found


def with_equal_sizes(scene: MultiView) -> MultiView:
    """The scene itself. Raises InputError where it has fewer than two views, or one of another size than the first."""
    if len(scene.views) < 2:
        raise InputError(f"{scene.views[0].path}: is the only view; at least two are needed to compare")
    first = scene.views[0].path
    size = read_size(first)
    for view in scene.views[1:]:
        if (found := read_size(view.path)) != size:
            raise InputError(f"{view.path}: is {found}, but {first.name} is {size}")
    return scene


def first_existing(folder: Path, stems: tuple[str, ...]) -> Path | None:
    """The first file of these names, with any extension that maps come in."""
    candidates = (folder / f"{stem}{extension}" for stem in stems for extension in MAP_EXTENSIONS)
    return next((path for path in candidates if path.is_file()), None)


def numbers_in(name: str) -> tuple[int, ...]:
    """The runs of digits in a name."""
    return tuple(int(digits) for digits in re.findall(r"\d{1,9}", name))
