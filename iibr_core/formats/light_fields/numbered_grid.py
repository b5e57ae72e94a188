"""Grids of views in a folder: v00_u00.png, Heber's 11x11 Pov-ray scenes, JPEG Pleno's 000_000.ppm (column, row), and
whatever else numbers its pictures by row and column, or row by row.

Rows are counted downwards, columns to the right. Views may lie in a subfolder `views`; maps lie beside it or in it.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from iibr_core.formats.light_fields.folder_writer import FolderWriter
from iibr_core.formats.light_fields.multi_view_scene import GridIndex, MultiView, numbers_in
from iibr_core.formats.light_fields.parameters import read_parameters, stated_grid, write_parameters
from iibr_core.formats.light_fields.view_grid import (
    candidate_views,
    grid_scene,
    missing_view,
    require_fitting,
    set_view,
    view_folder,
)
from iibr_core.types import GridShape, InputError

MAP_WORDS = re.compile(r"disp|depth|mask|label|normal|edge|reliable", re.IGNORECASE)
V_U = re.compile(r"v(\d{1,9})_u(\d{1,9})$")
JPEG_PLENO = re.compile(r"(\d{3})_(\d{3})\.ppm$", re.IGNORECASE)
"""Column and row, both three digits."""
LEAST_SIDE = 9
"""Of a square grid that only the number of its pictures tells."""
HEBER_GRID = GridShape(11, 11)


class NumberedGridWriter(FolderWriter):
    """Writes v00_u00.png and so on; disparity beside them as an estimate, and parameters.cfg."""

    own_file = re.compile(r"parameters\.cfg|v\d+_u\d+\.(png|exr)|disp_est_u\d+_v\d+\.pfm")

    def view_name(self, row: int, column: int, extension: str) -> str:
        """By row and column."""
        return f"v{row:02d}_u{column:02d}{extension}"

    def map_names(self, row: int, column: int, is_wanted: bool, is_centre: bool) -> tuple[str, ...]:
        """Column first, as the readers of such folders have it."""
        return (f"disp_est_u{column:02d}_v{row:02d}.pfm",) if is_wanted or is_centre else ()

    def finish_folder(self, folder: Path) -> None:
        """Focal length and range of disparities."""
        write_parameters(folder, self.name, self.grid, self.size, self.focal_px, self.range_px)


def read_numbered_grid(folder: Path) -> MultiView | None:
    """The views of a grid folder, None where its pictures are not numbered as a grid.

    Ground truth: gt_disp_uUU_vVV.*, or the one map of the folder for the centre view; estimates: disp_est_uUU_vVV.*;
    HCI's names for maps too. Raises InputError where a grid has gaps.
    """
    paths = _paths_by_place(folder, candidate_views(folder))
    if not paths:
        return None
    grid = GridShape(max(v for v, _ in paths) + 1, max(u for _, u in paths) + 1)
    _require_whole(folder, grid, paths)
    size = f"{grid.columns}x{grid.rows}"
    layout = f"Pov-ray (Heber), {size}" if grid == HEBER_GRID else f"grid folder, {size}"
    return grid_scene(folder, layout, grid, paths)


def _paths_by_place(folder: Path, pictures: list[Path]) -> dict[GridIndex, Path]:
    """Pictures by row and column; empty where their names do not tell."""
    paths: dict[GridIndex, Path] = {}
    for path in pictures:
        if match := V_U.match(path.stem):
            set_view(paths, (int(match[1]), int(match[2])), path)
    if not paths and pictures and all(map(JPEG_PLENO.match, (path.name for path in pictures))):
        paths = {(int(path.stem[4:]), int(path.stem[:3])): path for path in pictures}
        first_row, first_column = (min(axis) for axis in zip(*paths))
        return {(row - first_row, column - first_column): path for (row, column), path in paths.items()}
    return paths or _by_any_numbers(folder, [path for path in pictures if not MAP_WORDS.search(path.stem)])


def _by_any_numbers(folder: Path, pictures: list[Path]) -> dict[GridIndex, Path]:
    """By the two numbers that differ from name to name, each counted from its least; by one, row by row."""
    numbered = {path: numbers_in(path.stem) for path in pictures}
    kinds = {re.sub(r"\d+", "#", path.stem.lower()) for path in pictures}
    if len(pictures) < 2 or len(kinds) != 1 or not all(numbered.values()):
        return {}
    fields = list(zip(*numbered.values()))
    varying = [k for k, values in enumerate(fields) if len(set(values)) > 1]
    if len(varying) == 1:
        return _row_by_row(folder, {numbers[varying[0]]: path for path, numbers in numbered.items()})
    if len(varying) != 2:
        return {}
    row, column = varying
    paths: dict[GridIndex, Path] = {}
    for path, numbers in numbered.items():
        set_view(paths, (numbers[row] - min(fields[row]), numbers[column] - min(fields[column])), path)
    return paths


def _row_by_row(folder: Path, pictures: dict[int, Path]) -> dict[GridIndex, Path]:
    """Pictures by their one number, in rows of the grid that a parameters file states, else of a large square: a few
    numbered pictures may be of a holiday.
    """
    side = math.isqrt(len(pictures))
    stated = stated_grid(read_parameters(folder))
    if stated is None and (side < LEAST_SIDE or side**2 != len(pictures)):
        return {}
    grid = stated or GridShape(side, side)
    numbers = sorted(pictures)
    gaps = sorted(set(range(numbers[0], numbers[-1] + 1)) - set(numbers))
    if gaps and len(gaps) < len(pictures):
        raise InputError(f"{folder}: view {gaps[0]} is missing ({len(gaps)} are); get the whole data set")
    if grid.rows * grid.columns != len(pictures):
        raise InputError(
            f"{folder}: {len(pictures)} views do not fill a grid of {grid.rows}x{grid.columns};"
            " say num_cams_x and num_cams_y in parameters.cfg"
        )
    return {divmod(k, grid.columns): pictures[number] for k, number in enumerate(numbers)}


def _require_whole(folder: Path, grid: GridShape, paths: dict[GridIndex, Path]) -> None:
    """Raise InputError for the first place that no view has."""
    require_fitting(folder, grid, len(paths))
    missing = [(v, u) for v in range(grid.rows) for u in range(grid.columns) if (v, u) not in paths]
    if not missing:
        return
    (v, u), one = missing[0], next(iter(paths.values()))
    if V_U.match(one.stem):
        raise missing_view(one.with_stem(f"v{v:02d}_u{u:02d}"), len(missing), grid, (v, u))
    raise InputError(
        f"{view_folder(folder)}: the view in row {v}, column {u} is missing "
        f"({len(missing)} of {grid.rows}x{grid.columns} views are); get the whole data set"
    )
