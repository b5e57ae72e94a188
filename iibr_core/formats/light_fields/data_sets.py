"""Folders of data sets whose views are no numbered grid: the Stanford archive and Middlebury stereo.

Stanford: a folder of out_RR_CC_Y_X.png, with row, column and camera position; renderers add focal length and sensor.
Positions count: X grows to the right and Y downwards. Rows and columns are counted as the camera moved, which differs
from scene to scene. Cameras stand slightly off the grid; one view step is the mean spacing of columns.

Middlebury: pairs of 2014 and 2021 (im0, im1, disp0.pfm) and rows of views of 2001 to 2006 (im0..im8 or view0..view6)
with ground truth for two of them. Pictures are rectified and evenly spaced, from left to right; one view step is the
distance of neighbours.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import (
    KnownDisparity,
    KnownView,
    MultiView,
    maps_in,
    pictures_in,
    place_on_grid,
    slope,
)
from iibr_core.types import InputError, ViewOffset

NUMBER = r"[-+]?\d{1,9}(?:\.\d{0,12})?"
STANFORD_NAME = re.compile(rf"(?:.*_)?(\d{{1,3}})_+(\d{{1,3}})_+({NUMBER})_+({NUMBER})_*$")
FRACTION = r"[-+]?\d{1,9}\.\d{1,12}"
RENDERED_NAME = re.compile(rf".*_(\d{{1,3}})_(\d{{1,3}})_({FRACTION})_({FRACTION})_{NUMBER}_{NUMBER}$")
MAX_STRAY = 0.5
"""Largest distance of a camera from its place in the grid, in view steps; beyond it, positions mean something else."""
MIN_NOTED_STRAY = 0.005
USUAL_DIRECTIONS = np.array([-1, 1])
"""Directions in which rows and columns are counted where positions are unknown: upwards and to the right."""
MIDDLEBURY_NAME = re.compile(r"(im|view)(\d)$")
FULL_WIDTH = {"im": 1800, "view": 1350}
"""Widths of full-size pictures of 2003, and of 2005 and 2006: smaller copies store disparity times the same ratio."""
TRUTH_AT = {"im": (2, 6), "view": (1, 5)}
STEPS_BETWEEN_TRUTHS = 4
SCALE_2001 = 8.0
MAX_WIDTH_2001 = 440
QUANTIZED = (".png", ".pgm")


def read_stanford(folder: Path) -> MultiView | None:
    """Return the views of a Stanford archive folder or of its subfolder `rectified`; None if names are different."""
    inside = folder / "rectified" if (folder / "rectified").is_dir() else folder
    matches = [(path, STANFORD_NAME.match(path.stem) or RENDERED_NAME.match(path.stem)) for path in pictures_in(inside)]
    named = [(path, match) for path, match in matches if match]
    if not named:
        return None
    index = np.array([[int(match[1]), int(match[2])] for _, match in named])
    position = np.array([[float(match[3]), float(match[4])] for _, match in named])
    if len(np.unique(index, axis=0)) < len(index):
        raise InputError(f"{inside}: two pictures have the same row and column; remove one of them")
    offsets, directions, note, are_known = _viewpoints(index, position)
    views = tuple(
        KnownView(f"row {row} column {column}", ViewOffset(float(t), float(s)), PictureSource(path))
        for (path, _), (row, column), (t, s) in zip(named, index, offsets)
    )
    layout = f"Stanford archive, {len(np.unique(index[:, 1]))}x{len(np.unique(index[:, 0]))}"
    scene = MultiView(folder.resolve().name, layout, views, notes=(note,))
    placed = place_on_grid(scene, [(int(row), int(column)) for row, column in index * directions])
    if are_known or placed.grid is None:
        return placed
    ranks = [np.unique(index[:, axis], return_inverse=True)[1] for axis in (0, 1)]
    numbers = tuple((int(row), int(column)) for row, column in zip(*ranks))
    return replace(placed, numbers=numbers, is_stated=True)


def _viewpoints(index: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, str, bool]:
    """Return viewpoints (N, 2), t down and s right, in view steps; directions in which rows and columns are counted,
    down and right positive; a note about the positions; and whether they are known.

    index: rows and columns (N, 2). position: Y and X (N, 2) in any unit.
    """
    slopes = np.array([slope(index[:, axis], position[:, axis]) for axis in (0, 1)])
    step = float(abs(slopes[1] or slopes[0]))
    if step == 0:
        note = "Camera positions are unknown: a regular grid is assumed."
        return index * USUAL_DIRECTIONS, USUAL_DIRECTIONS, note, False
    directions = np.where(slopes != 0, np.sign(slopes).astype(int), USUAL_DIRECTIONS)
    offsets, regular = (position - position.mean(axis=0)) / step, index * directions
    spacing = np.where(slopes != 0, np.abs(slopes) / step, 1.0)
    stray = float(np.abs(offsets - (regular - regular.mean(axis=0)) * spacing).max())
    if stray > MAX_STRAY:
        note = f"Camera positions lie up to {stray:.1f} view steps off the grid: a regular grid is assumed."
        return index * USUAL_DIRECTIONS, USUAL_DIRECTIONS, note, False
    more = f"; cameras stand up to {stray:.2f} view steps off a regular grid" if stray >= MIN_NOTED_STRAY else ""
    return offsets, directions, f"Viewpoints from the names{more}.", True


def read_middlebury(folder: Path) -> MultiView | None:
    """Return the views of a Middlebury folder, None for other folders. In maps, unknown disparity is infinite or 0."""
    matches = [(MIDDLEBURY_NAME.match(path.stem.lower()), path) for path in pictures_in(folder)]
    named = {(match[1], int(match[2])): path for match, path in matches if match}
    if len(named) < 2 or len({kind for kind, _ in named}) > 1:
        return None
    kind = next(iter(named))[0]
    if (folder / "disp0.pfm").is_file() and set(named) == {("im", 0), ("im", 1)}:
        maps = {n: KnownDisparity(path) for n in (0, 1) if (path := folder / f"disp{n}.pfm").is_file()}
        layout = "Middlebury pair"
    else:
        maps, layout = _coded_maps(folder, kind, next(iter(named.values()))), f"Middlebury, {len(named)} views"
    numbers = sorted(number for _, number in named)
    views = tuple(KnownView(f"{kind}{n}", ViewOffset(0.0, float(n)), PictureSource(named[kind, n])) for n in numbers)
    known = {numbers.index(n): disparity for n, disparity in maps.items() if n in numbers}
    return place_on_grid(MultiView(folder.resolve().name, layout, views, known), [(0, n) for n in numbers])


def _coded_maps(folder: Path, kind: str, picture: Path) -> dict[int, KnownDisparity]:
    """Return maps of integers: disparity between the two views of TRUTH_AT, times a factor that depends on the size."""
    maps, width = maps_in(folder), open_picture(picture).size.width
    is_of_2001 = picture.suffix.lower() == ".ppm" and kind == "im" and width < MAX_WIDTH_2001
    factor = SCALE_2001 if is_of_2001 else float(max(round(FULL_WIDTH[kind] / width), 1))
    known: dict[int, KnownDisparity] = {}
    for n in TRUTH_AT[kind]:
        if path := maps.get(f"disp{n}"):
            scale = 1 / factor if path.suffix.lower() in QUANTIZED else 1.0
            known[n] = KnownDisparity(path, scale / STEPS_BETWEEN_TRUTHS)
    return known
