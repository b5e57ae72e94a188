"""The (new) Stanford Light Field Archive: a folder of out_RR_CC_Y_X.png, row, column and camera position.

Rows are counted upwards there and columns to the right, as the archive's readers take them; the folder itself does not
say. Cameras stand off the grid by little; their positions give the viewpoints, one view step being the mean spacing of
columns.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from iibr_core.formats.files import is_folder, shown_name
from iibr_core.formats.light_fields.folder_writer import FolderWriter
from iibr_core.formats.light_fields.scene import KnownView, MultiView, on_grid, pictures_in
from iibr_core.types import InputError, ViewOffset

NUMBER = r"[-+]?\d{1,9}(?:\.\d{0,12})?"
NAME = re.compile(rf"(?:.*_)?(\d{{1,3}})_(\d{{1,3}})_({NUMBER})_({NUMBER})_?$")
MOST_STRAY = 0.5
"""A camera farther off its place in the grid than this, in view steps: the positions mean something else."""


class StanfordWriter(FolderWriter):
    """Writes out_RR_CC_Y_X_.png, rows counted upwards, positions in view steps. The layout has no place for disparity:
    every view's lies beside it as disp_RR_CC.pfm.
    """

    own_file = re.compile(r"out_\d+_\d+_[-\d.]+_[-\d.]+_\.(png|exr)|disp_\d+_\d+\.pfm")

    def view_name(self, row: int, column: int, extension: str) -> str:
        """With the camera's place, up and to the right."""
        t, s = self.grid.offset(row, column)
        return f"out_{self._upwards(row):02d}_{column:02d}_{-t:.6f}_{s:.6f}_{extension}"

    def map_names(self, row: int, column: int, is_wanted: bool, is_centre: bool) -> tuple[str, ...]:
        """As the views are counted."""
        return (f"disp_{self._upwards(row):02d}_{column:02d}.pfm",) if is_wanted else ()

    def _upwards(self, row: int) -> int:
        return self.grid.rows - 1 - row


def read_stanford(folder: Path) -> MultiView | None:
    """The views of a Stanford archive folder (or of its subfolder `rectified`), None where names are others."""
    inside = next(
        (p for p in (folder / "rectified", folder) if is_folder(p) and any(map(_match, pictures_in(p)))), None
    )
    if inside is None:
        return None
    named = [(path, match) for path in pictures_in(inside) if (match := _match(path))]
    index = np.array([[int(match[1]), int(match[2])] for _, match in named])
    position = np.array([[float(match[3]), float(match[4])] for _, match in named])
    offsets, notes = _offsets(index, position)
    if len(np.unique(index, axis=0)) < len(index):
        raise InputError(f"{inside}: two pictures have the same row and column; remove one of them")
    views = tuple(
        KnownView(f"row {row} column {column}", ViewOffset(float(t), float(s)), path)
        for (path, _), (row, column), (t, s) in zip(named, index, offsets)
    )
    shape = f"{len(np.unique(index[:, 1]))}x{len(np.unique(index[:, 0]))}"
    scene = MultiView(shown_name(folder.resolve().name), f"Stanford archive, {shape}", views, notes=notes)
    return on_grid(scene, [(-int(row), int(column)) for row, column in index])


def _match(path: Path) -> re.Match[str] | None:
    return NAME.match(path.stem)


def _offsets(index: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Viewpoints (N, 2), t down and s right, from rows and columns (N, 2) and camera positions (N, 2)."""
    regular = index * np.array([-1.0, 1.0])
    slopes = [_slope(regular[:, axis], position[:, axis]) for axis in (0, 1)]
    step = abs(slopes[1] or slopes[0])
    if step == 0:
        return regular, ("Camera positions are not told: a regular grid is assumed.",)
    signs = np.array([np.sign(slope) or 1.0 for slope in slopes])
    offsets = (position - position.mean(axis=0)) * signs / step
    spacing = np.array([abs(slope) / step if slope else 1.0 for slope in slopes])
    stray = np.abs(offsets - (regular - regular.mean(axis=0)) * spacing).max()
    if stray > MOST_STRAY:
        return regular, (f"Camera positions lie up to {stray:.1f} view steps off the grid: a regular one is assumed.",)
    return offsets, (f"Viewpoints from the names; cameras stand up to {stray:.2f} view steps off a regular grid.",)


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    """Of the line through (x, y), each (N,); 0 where all x are equal."""
    centred = x - x.mean()
    spread = float((centred**2).sum())
    return float((centred * (y - y.mean())).sum() / spread) if spread > 0 else 0.0
