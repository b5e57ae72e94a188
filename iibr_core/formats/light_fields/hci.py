"""Light fields as folders, laid out as in the HCI 4D Light Field Benchmark (Honauer et al., ACCV 2016).

`input_Cam000.png` .. row by row (v * columns + u), `gt_disp_lowres.pfm` for the centre view, `disp_Cam000.pfm` .. for
every view where wanted, `parameters.cfg`. HDR views are half-float EXR (linear light) instead of PNG. Reading also
knows HCI's `gt_disp_lowres_Cam000.pfm` and other kinds of pictures and maps.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

from iibr_core.formats.light_fields.folder_writer import FolderWriter
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.parameters import read_parameters, stated_grid, write_parameters
from iibr_core.formats.light_fields.view_grid import (
    candidate_views,
    grid_scene,
    missing_view,
    require_fitting,
    set_view,
)
from iibr_core.types import GridShape, InputError

CAM_NAME = re.compile(r"input_cam(\d{1,9})$", re.IGNORECASE)


class HciWriter(FolderWriter):
    """Writes views as the benchmark has them."""

    own_file = re.compile(r"input_Cam\d+\.(png|exr)|disp_Cam\d+\.pfm|gt_disp_lowres\.pfm|parameters\.cfg")

    def view_name(self, row: int, column: int, extension: str) -> str:
        """Numbered row by row."""
        return f"input_Cam{self._number(row, column):03d}{extension}"

    def map_names(self, row: int, column: int, is_wanted: bool, is_centre: bool) -> tuple[str, ...]:
        """The centre view's always, by the name that the benchmark has for it."""
        every = (f"disp_Cam{self._number(row, column):03d}.pfm",) if is_wanted else ()
        return (*every, "gt_disp_lowres.pfm") if is_centre else every

    def finish_folder(self, folder: Path) -> None:
        """The cameras' parameters."""
        write_parameters(folder, self.name, self.grid, self.size, self.focal_px, self.range_px)

    def _number(self, row: int, column: int) -> int:
        return row * self.grid.columns + column


def read_hci(folder: Path) -> MultiView | None:
    """The views of a folder (or its subfolder `views`) that are named as HCI's, None where there are none.

    The grid comes from parameters.cfg, else a square is assumed. Maps are named as HCI's too, see `HciWriter`, or as
    in `numbered_grid`. Raises InputError where views are missing or do not fit the grid.
    """
    pictures: dict[int, Path] = {}
    for path in candidate_views(folder):
        if match := CAM_NAME.match(path.stem):
            set_view(pictures, int(match[1]), path)
    if not pictures:
        return None
    grid = _grid(folder, pictures, stated_grid(read_parameters(folder)))
    paths = {divmod(k, grid.columns): pictures[number] for k, number in enumerate(_row_by_row(pictures, grid))}
    return grid_scene(folder, f"HCI 4D light field, {grid.columns}x{grid.rows}", grid, paths)


def _grid(folder: Path, pictures: dict[int, Path], stated: GridShape | None) -> GridShape:
    if stated is not None:
        require_fitting(folder, stated, len(pictures))
        return stated
    if gaps := _gaps(pictures):
        raise missing_view(_path_of(gaps[0], pictures), len(gaps), len(pictures) + len(gaps))
    side = math.isqrt(len(pictures))
    if side**2 != len(pictures):
        raise InputError(
            f"{folder}: {len(pictures)} views do not form a square grid; state num_cams_x and num_cams_y in"
            " parameters.cfg"
        )
    return GridShape(side, side)


def _row_by_row(pictures: dict[int, Path], grid: GridShape) -> list[int]:
    """The numbers of all views of a grid, in order. Raises InputError naming the first view that is missing."""
    total = grid.rows * grid.columns
    if len(pictures) < total or _gaps(pictures):
        missing = [number for number in range(total) if number not in pictures]
        raise missing_view(_path_of(missing[0], pictures), len(missing), grid, divmod(missing[0], grid.columns))
    return sorted(pictures)


def _gaps(pictures: dict[int, Path]) -> list[int]:
    """Numbers left out between the first and the last view; none where most are, as where every tenth view was kept."""
    span = range(min(pictures), max(pictures) + 1)
    if len(span) >= 2 * len(pictures):
        return []
    return [number for number in span if number not in pictures]


def _path_of(number: int, pictures: dict[int, Path]) -> Path:
    """Where a missing view would lie."""
    one = next(iter(pictures.values()))
    return one.with_stem(f"input_Cam{number:03d}")
