"""Grids of views in a folder: HCI's input_Cam000.png, v00_u00.png, Heber's 11x11 Pov-ray scenes, and whatever else
numbers its pictures by row and column, or row by row.

Rows are counted downwards, columns to the right. Views may lie in a subfolder `views`; maps lie beside it or in it.
"""

from __future__ import annotations

import configparser
import math
import re
from pathlib import Path

from iibr_core.formats.light_fields.scene import (
    MAP_EXTENSIONS,
    KnownDisparity,
    KnownView,
    MultiView,
    first_existing,
    numbers_in,
    pictures_in,
)
from iibr_core.types import GridShape, InputError, ViewOffset

MAP_WORDS = re.compile(r"disp|depth|mask|label|normal|edge|reliable", re.IGNORECASE)
CAM = re.compile(r"input_cam\d+$", re.IGNORECASE)
V_U = re.compile(r"v(\d+)_u(\d+)$")
HEBER_GRID = GridShape(11, 11)

Index = tuple[int, int]


def read_numbered_grid(folder: Path) -> MultiView | None:
    """The views of a grid folder, None where its pictures are not numbered as a grid.

    Ground truth: gt_disp_uUU_vVV.*, HCI's gt_disp_lowres.pfm and gt_disp_lowres_CamNNN.pfm, or the one map of the
    folder for the centre view; estimates: disp_est_uUU_vVV.*, disp_CamNNN.pfm. Raises InputError where a grid has gaps.
    """
    inside = folder / "views" if (folder / "views").is_dir() else folder
    pictures = _views_among(pictures_in(inside))
    indices = _indices(folder, pictures)
    if not indices:
        return None
    grid = GridShape(max(v for v, _ in indices) + 1, max(u for _, u in indices) + 1)
    missing = [(v, u) for v in range(grid.rows) for u in range(grid.columns) if (v, u) not in indices]
    if missing:
        v, u = missing[0]
        raise InputError(
            f"{inside}: the view in row {v}, column {u} is missing "
            f"({len(missing)} of {grid.columns}x{grid.rows} views are); get the whole data set"
        )
    ordered = sorted(indices)
    views = tuple(KnownView(f"v{v:02d} u{u:02d}", ViewOffset(float(v), float(u)), indices[v, u]) for v, u in ordered)
    maps = {ordered.index(at): known for at, known in _maps(folder, grid).items() if at in indices}
    return MultiView(folder.resolve().name, _layout(pictures, grid), views, maps)


def _views_among(pictures: list[Path]) -> list[Path]:
    """Without maps and the like: those named as views if there are any, else those not named as something else."""
    for pattern in (CAM, V_U):
        if named := [path for path in pictures if pattern.match(path.stem)]:
            return named
    return [path for path in pictures if not MAP_WORDS.search(path.stem)]


def _layout(pictures: list[Path], grid: GridShape) -> str:
    size = f"{grid.columns}x{grid.rows}"
    if CAM.match(pictures[0].stem):
        return f"HCI 4D light field, {size}"
    return f"Pov-ray (Heber), {size}" if grid == HEBER_GRID else f"grid folder, {size}"


def _indices(folder: Path, pictures: list[Path]) -> dict[Index, Path]:
    """Pictures by row and column; empty where their names do not tell."""
    numbered = {path: numbers_in(path.stem) for path in pictures}
    kinds = {re.sub(r"\d+", "#", path.stem.lower()) for path in pictures}
    if len(pictures) < 2 or len(kinds) != 1 or not all(numbered.values()):
        return {}
    fields = list(zip(*numbered.values()))
    varying = [k for k, values in enumerate(fields) if len(set(values)) > 1]
    if all(V_U.match(path.stem) for path in pictures):
        varying, base = [len(fields) - 2, len(fields) - 1], (0, 0)
    elif len(varying) == 2:
        base = (min(fields[varying[0]]), min(fields[varying[1]]))
    elif len(varying) == 1:
        return _row_by_row(folder, sorted(pictures, key=lambda path: numbered[path][varying[0]]))
    else:
        return {}
    row, column = varying
    found: dict[Index, Path] = {}
    for path, numbers in numbered.items():
        at = numbers[row] - base[0], numbers[column] - base[1]
        if at in found:
            raise InputError(f"{path}: shows the same view as {found[at].name}; remove one of them")
        found[at] = path
    return found


def _row_by_row(folder: Path, pictures: list[Path]) -> dict[Index, Path]:
    numbers = [numbers_in(path.stem)[-1] for path in pictures]
    if not CAM.match(pictures[0].stem) and math.isqrt(len(pictures)) ** 2 != len(pictures):
        return {}
    gaps = sorted(set(range(numbers[0], numbers[-1] + 1)) - set(numbers))
    if gaps and len(gaps) < len(pictures):
        raise InputError(f"{folder}: view {gaps[0]} is missing ({len(gaps)} are); get the whole data set")
    grid = _stated_grid(folder / "parameters.cfg") or GridShape(*[math.isqrt(len(pictures))] * 2)
    if grid.rows * grid.columns != len(pictures):
        raise InputError(
            f"{folder}: {len(pictures)} views do not fill a grid of {grid.columns}x{grid.rows};"
            " say num_cams_x and num_cams_y in parameters.cfg"
        )
    return {divmod(k, grid.columns): path for k, path in enumerate(pictures)}


def _stated_grid(path: Path) -> GridShape | None:
    """The grid of HCI's parameters.cfg, None where it does not say."""
    if not path.is_file():
        return None
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string(path.read_text("utf-8-sig"))
        rows, columns = (parser.getint("extrinsics", f"num_cams_{axis}", fallback=0) for axis in "yx")
    except (configparser.Error, ValueError, OSError) as error:
        reason = str(error).partition("\n")[0]
        raise InputError(f"{path}: cannot be read as parameters ({reason}); correct or remove it") from error
    return GridShape(rows, columns) if rows > 0 and columns > 0 else None


def _maps(folder: Path, grid: GridShape) -> dict[Index, KnownDisparity]:
    found: dict[Index, KnownDisparity] = {}
    for v in range(grid.rows):
        for u in range(grid.columns):
            cam = v * grid.columns + u
            truth = first_existing(folder, (f"gt_disp_u{u:02d}_v{v:02d}", f"gt_disp_lowres_Cam{cam:03d}"))
            estimate = first_existing(folder, (f"disp_est_u{u:02d}_v{v:02d}", f"disp_Cam{cam:03d}"))
            if truth or estimate:
                found[v, u] = KnownDisparity(truth or estimate, is_truth=truth is not None)  # type: ignore[arg-type]
    if grid.centre not in found and (sole := first_existing(folder, ("gt_disp_lowres",)) or _sole_map(folder)):
        found[grid.centre] = KnownDisparity(sole)
    return found


def _sole_map(folder: Path) -> Path | None:
    """The one file that looks like the centre view's disparity; None where there are several or none."""
    maps = [p for p in sorted(folder.iterdir()) if "disp" in p.stem.lower() and p.suffix.lower() in MAP_EXTENSIONS[:3]]
    return maps[0] if len(maps) == 1 and not numbers_in(maps[0].stem) else None
