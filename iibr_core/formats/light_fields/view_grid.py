"""What folders of views on a grid share, however they are named: where their pictures and maps lie, and what is said of
gaps.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

from iibr_core.formats.files import entries_of, is_folder, shown_name
from iibr_core.formats.images.oiio_reader import read_size
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import (
    MAP_EXTENSIONS,
    PICTURE_EXTENSIONS,
    GridIndex,
    KnownDisparity,
    KnownView,
    MultiView,
    first_map,
    maps_in,
    numbers_in,
    pictures_in,
)
from iibr_core.formats.light_fields.parameters import read_parameters, stated_focal_px, stated_range_px
from iibr_core.types import GridShape, InputError, ViewOffset

Key = TypeVar("Key")


def view_folder(folder: Path) -> Path:
    """Where the views of a scene lie: its subfolder `views`, or the folder itself."""
    return folder / "views" if is_folder(folder / "views") else folder


def candidate_views(folder: Path) -> list[Path]:
    """The pictures of a scene's folder by name; of one that is there in several kinds, that which comes first among
    PICTURE_EXTENSIONS.
    """
    last_first = sorted(pictures_in(view_folder(folder)), key=lambda path: -_preference(path))
    return sorted({path.stem: path for path in last_first}.values())


def _preference(path: Path) -> int:
    return PICTURE_EXTENSIONS.index(path.suffix.lower())


def set_view(views: dict[Key, Path], at: Key, path: Path) -> None:
    """Put a picture in its place, or under its number. Raises InputError where another one has it."""
    if at in views:
        raise InputError(f"{path}: shows the same view as {views[at].name}; remove one of them")
    views[at] = path


def require_fitting(folder: Path, grid: GridShape, count: int) -> None:
    """Some views may be missing, which is said by name; half of them, or too many, mean that the grid is wrong."""
    if grid.rows < 1 or grid.columns < 1 or not count <= grid.rows * grid.columns <= 2 * count:
        raise InputError(
            f"{folder}: {count} views do not fit a grid of {grid.rows}x{grid.columns}; correct names or parameters.cfg"
        )


def missing_view(path: Path, missing: int, of: GridShape | int, at: GridIndex | None = None) -> InputError:
    """The error about a view that should be at `path`: so many are missing, of a grid or of a row of views."""
    total = of if isinstance(of, int) else f"{of.rows}x{of.columns}"
    place = "" if at is None else f"; row {at[0]}, column {at[1]}"
    return InputError(f"{path}: this view is missing ({missing} of {total} views are{place}); get the whole data set")


def grid_scene(folder: Path, layout: str, grid: GridShape, paths: Mapping[GridIndex, Path]) -> MultiView:
    """The scene of a folder whose views, all of a grid, are known by row and column.

    The folder's parameters.cfg, if there is one, tells the focal length and the range of disparities. Raises InputError
    where it is damaged, and where the size of a view, which the focal length needs, cannot be read.
    """
    places = sorted(paths)
    views = tuple(
        KnownView(f"v{v:02d} u{u:02d}", ViewOffset(float(v), float(u)), PictureSource(paths[v, u]), place=(v, u))
        for v, u in places
    )
    maps = {places.index(at): known for at, known in _maps(folder, grid).items()}
    parameters = read_parameters(folder)
    return MultiView(
        shown_name(folder.resolve().name),
        layout,
        views,
        maps,
        stated_range_px(parameters),
        grid=grid,
        focal_px=stated_focal_px(parameters, read_size(views[0].path)) if parameters else None,
    )


def _maps(folder: Path, grid: GridShape) -> dict[GridIndex, KnownDisparity]:
    maps = maps_in(folder)
    found: dict[GridIndex, KnownDisparity] = {}
    for v in range(grid.rows):
        for u in range(grid.columns):
            cam = v * grid.columns + u
            truth = first_map(maps, f"gt_disp_u{u:02d}_v{v:02d}", f"gt_disp_lowres_Cam{cam:03d}")
            estimate = first_map(maps, f"disp_est_u{u:02d}_v{v:02d}", f"disp_Cam{cam:03d}")
            if path := truth or estimate:
                found[v, u] = KnownDisparity(path, is_truth=truth is not None)
    if grid.centre not in found and (sole := first_map(maps, "gt_disp_lowres") or _sole_map(folder)):
        found[grid.centre] = KnownDisparity(sole)
    return found


def _sole_map(folder: Path) -> Path | None:
    """The one file that looks like the centre view's disparity; None where there are several or none."""
    maps = [p for p in entries_of(folder) if "disp" in p.stem.lower() and p.suffix.lower() in MAP_EXTENSIONS[:3]]
    return maps[0] if len(maps) == 1 and not numbers_in(maps[0].stem) else None
