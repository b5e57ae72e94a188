"""The (new) Stanford Light Field Archive: a folder of out_RR_CC_Y_X.png, row, column and camera position; and the names
that light-field-renderer adds a focal length and a sensor width to, both in mm.

Positions count: X grows to the right and Y downwards. Rows and columns are counted as the camera went, which differs
from scene to scene. Cameras stand off the grid by little; one view step is the mean spacing of columns.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iibr_core.formats.files import is_file, is_folder, read_text, shown_name
from iibr_core.formats.images.picture_source import PictureSource, source_size
from iibr_core.formats.light_fields.folder_writer import FolderWriter
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView, on_grid, pictures_in
from iibr_core.types import InputError, ViewOffset

NUMBER = r"[-+]?\d{1,9}(?:\.\d{0,12})?"
NAME = re.compile(rf"(?:.*_)?(\d{{1,3}})_(\d{{1,3}})_({NUMBER})_({NUMBER})_?$")
RENDERED_NAME = re.compile(rf"(?:.*_)?(\d{{1,3}})_(\d{{1,3}})_({NUMBER})_({NUMBER})_({NUMBER})_({NUMBER})$")
MOST_STRAY = 0.5
"""A camera farther off its place in the grid than this, in view steps: the positions mean something else."""
TOLD_STRAY = 0.005
CONFIG = "config.cfg"
FOCUS_DISTANCE = "focus-distance"
"""Of light-field-renderer's config: where to begin, the least and the greatest, in metres."""
USUAL_DIRECTIONS = (-1, 1)
"""Of rows and columns where positions are not told: upwards and to the right."""


class StanfordWriter(FolderWriter):
    """Writes out_RR_CC_Y_X_.png, rows counted upwards, positions in view steps. The layout has no place for disparity:
    every view's lies beside it as disp_RR_CC.pfm.
    """

    own_file = re.compile(r"out_\d+_\d+_[-\d.]+_[-\d.]+_\.(png|exr)|disp_\d+_\d+\.pfm")

    def view_name(self, row: int, column: int, extension: str) -> str:
        """With the camera's place, down and to the right."""
        t, s = self.grid.offset(row, column)
        return f"out_{self._upwards(row):02d}_{column:02d}_{t:.6f}_{s:.6f}_{extension}"

    def map_names(self, row: int, column: int, is_wanted: bool, is_centre: bool) -> tuple[str, ...]:
        """As the views are counted."""
        return (f"disp_{self._upwards(row):02d}_{column:02d}.pfm",) if is_wanted else ()

    def _upwards(self, row: int) -> int:
        return self.grid.rows - 1 - row


def read_stanford(folder: Path) -> MultiView | None:
    """The views of a Stanford archive folder (or of its subfolder `rectified`), or of light-field-renderer's; None
    where names are others. Raises InputError for two pictures of a place, and a damaged config.
    """
    inside = next(
        (p for p in (folder / "rectified", folder) if is_folder(p) and any(map(_match, pictures_in(p)))), None
    )
    if inside is None:
        return None
    named = [(path, match) for path in pictures_in(inside) if (match := _match(path))]
    index = np.array([[int(match[1]), int(match[2])] for _, match in named])
    position = np.array([[float(match[3]), float(match[4])] for _, match in named])
    if len(np.unique(index, axis=0)) < len(index):
        raise InputError(f"{inside}: two pictures have the same row and column; remove one of them")
    layout = _lay_out(index, position)
    views = tuple(
        KnownView(f"row {row} column {column}", ViewOffset(float(t), float(s)), PictureSource(path))
        for (path, _), (row, column), (t, s) in zip(named, index, layout.offsets)
    )
    shape = f"{len(np.unique(index[:, 1]))}x{len(np.unique(index[:, 0]))}"
    is_rendered = named[0][1].re is RENDERED_NAME
    focal_px = _focal_px(inside, named[0][1], views[0]) if is_rendered else None
    scene = MultiView(
        shown_name(folder.resolve().name),
        f"light-field-renderer, {shape}" if is_rendered else f"Stanford archive, {shape}",
        views,
        range_px=_range_px(inside, focal_px, layout.step / 1000) if focal_px is not None else None,
        notes=(layout.note,),
        focal_px=focal_px,
    )
    return on_grid(scene, [(int(row), int(column)) for row, column in index * layout.directions])


def _match(path: Path) -> re.Match[str] | None:
    return RENDERED_NAME.match(path.stem) or NAME.match(path.stem)


class _Layout(NamedTuple):
    """offsets: viewpoints (N, 2), t down and s right, in view steps. directions: which way rows and columns are
    counted, down and right positive. step: of the positions from column to column, 0 where they tell nothing.
    """

    offsets: np.ndarray
    directions: np.ndarray
    step: float
    note: str


def _lay_out(index: np.ndarray, position: np.ndarray) -> _Layout:
    """From rows and columns (N, 2) and camera positions (N, 2)."""
    usual = np.array(USUAL_DIRECTIONS)
    slopes = np.array([_slope(index[:, axis], position[:, axis]) for axis in (0, 1)])
    directions = np.where(slopes != 0, np.sign(slopes).astype(int), usual)
    step = float(abs(slopes[1] or slopes[0]))
    if step == 0:
        return _Layout(index * usual, usual, 0.0, "Camera positions are not told: a regular grid is assumed.")
    offsets = (position - position.mean(axis=0)) / step
    regular = index * directions
    spacing = np.where(slopes != 0, np.abs(slopes) / step, 1.0)
    stray = float(np.abs(offsets - (regular - regular.mean(axis=0)) * spacing).max())
    if stray > MOST_STRAY:
        note = f"Camera positions lie up to {stray:.1f} view steps off the grid: a regular one is assumed."
        return _Layout(index * usual, usual, step, note)
    note = "Viewpoints from the names"
    note += f"; cameras stand up to {stray:.2f} view steps off a regular grid." if stray >= TOLD_STRAY else "."
    return _Layout(offsets, directions, step, note)


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    """Of the line through (x, y), each (N,); 0 where all x are equal."""
    centred = x - x.mean()
    spread = float((centred**2).sum())
    return float((centred * y).sum() / spread) if spread > 0 else 0.0


def _focal_px(folder: Path, name: re.Match[str], view: KnownView) -> float:
    focal_mm, sensor_mm = float(name[5]), float(name[6])
    if focal_mm <= 0 or sensor_mm <= 0:
        raise InputError(f"{folder}: {view.path.name} names a focal length of {focal_mm:g} mm; correct the names")
    return focal_mm / sensor_mm * source_size(view.picture).width


def _range_px(folder: Path, focal_px: float, step_m: float) -> tuple[float, float] | None:
    """Disparities of the distances that the folder's config lets people focus on, None where it tells none."""
    path = folder / CONFIG
    if not is_file(path) or step_m == 0:
        return None
    lines = read_text(path).splitlines()
    said = next((words[1:] for line in lines if (words := line.split()) and words[0] == FOCUS_DISTANCE), None)
    if said is None:
        return None
    try:
        _, near_m, far_m = map(float, said)
    except ValueError:
        near_m = far_m = 0.0
    if not 0 < near_m < far_m < np.inf:
        raise InputError(f"{path}: {FOCUS_DISTANCE} {' '.join(said)}: give a start, a least and a greatest distance")
    return focal_px * step_m / far_m, focal_px * step_m / near_m
