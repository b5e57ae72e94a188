"""The (new) Stanford Light Field Archive: a folder of out_RR_CC_Y_X.png, with row, column and camera position.

Positions count: X grows to the right and Y downwards. Rows and columns are counted as the camera moved, which differs
from scene to scene. Cameras stand slightly off the grid; one view step is the mean spacing of columns.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView, pictures_in, place_on_grid
from iibr_core.types import InputError, ViewOffset

NUMBER = r"[-+]?\d{1,9}(?:\.\d{0,12})?"
NAME = re.compile(rf"(?:.*_)?(\d{{1,3}})_(\d{{1,3}})_({NUMBER})_({NUMBER})_?$")
MAX_STRAY = 0.5
"""Largest distance of a camera from its place in the grid, in view steps; beyond it, positions mean something else."""
MIN_NOTED_STRAY = 0.005
USUAL_DIRECTIONS = np.array([-1, 1])
"""Directions in which rows and columns are counted where positions are unknown: upwards and to the right."""


def read_stanford(folder: Path) -> MultiView | None:
    """Return the views of a Stanford archive folder or of its subfolder `rectified`; None if names are different."""
    inside = folder / "rectified" if (folder / "rectified").is_dir() else folder
    named = [(path, match) for path in pictures_in(inside) if (match := NAME.match(path.stem))]
    if not named:
        return None
    index = np.array([[int(match[1]), int(match[2])] for _, match in named])
    position = np.array([[float(match[3]), float(match[4])] for _, match in named])
    if len(np.unique(index, axis=0)) < len(index):
        raise InputError(f"{inside}: two pictures have the same row and column; remove one of them")
    offsets, directions, note = _viewpoints(index, position)
    views = tuple(
        KnownView(f"row {row} column {column}", ViewOffset(float(t), float(s)), PictureSource(path))
        for (path, _), (row, column), (t, s) in zip(named, index, offsets)
    )
    layout = f"Stanford archive, {len(np.unique(index[:, 1]))}x{len(np.unique(index[:, 0]))}"
    scene = MultiView(folder.resolve().name, layout, views, notes=(note,))
    return place_on_grid(scene, [(int(row), int(column)) for row, column in index * directions])


def _viewpoints(index: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """Return viewpoints (N, 2), t down and s right, in view steps; directions in which rows and columns are counted,
    down and right positive; and a note about the positions.

    index: rows and columns (N, 2). position: Y and X (N, 2) in any unit.
    """
    slopes = np.array([_slope(index[:, axis], position[:, axis]) for axis in (0, 1)])
    step = float(abs(slopes[1] or slopes[0]))
    if step == 0:
        return index * USUAL_DIRECTIONS, USUAL_DIRECTIONS, "Camera positions are unknown: a regular grid is assumed."
    directions = np.where(slopes != 0, np.sign(slopes).astype(int), USUAL_DIRECTIONS)
    offsets, regular = (position - position.mean(axis=0)) / step, index * directions
    spacing = np.where(slopes != 0, np.abs(slopes) / step, 1.0)
    stray = float(np.abs(offsets - (regular - regular.mean(axis=0)) * spacing).max())
    if stray > MAX_STRAY:
        note = f"Camera positions lie up to {stray:.1f} view steps off the grid: a regular grid is assumed."
        return index * USUAL_DIRECTIONS, USUAL_DIRECTIONS, note
    more = f"; cameras stand up to {stray:.2f} view steps off a regular grid" if stray >= MIN_NOTED_STRAY else ""
    return offsets, directions, f"Viewpoints from the names{more}."


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    """Return the slope of the line fitted to (x, y), each (N,); 0 if all x are equal."""
    centred = x - x.mean()
    spread = float((centred**2).sum())
    return float((centred * y).sum() / spread) if spread > 0 else 0.0
