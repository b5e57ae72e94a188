"""Folders of views on a grid: HCI's `input_Cam000.png` (Honauer et al., ACCV 2016), `v00_u00.png`, JPEG Pleno's
`000_000.ppm` (column, row), and other pictures that are numbered by row and column, or row by row.

Rows are counted downwards, columns to the right. Views may lie in a subfolder `views`. Maps lie beside it; they are
named as HCI's (`gt_disp_lowres.pfm` for the centre view, `gt_disp_lowres_Cam000.pfm`, estimates `disp_Cam000.pfm`) or
by place (`gt_disp_u00_v00.npy`, estimates `disp_est_u00_v00.npy`).
"""

import configparser
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from iibr_core.formats.files import entries_of, read_text, reason_of
from iibr_core.formats.images.decode import read_size
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import (
    PICTURE_EXTENSIONS,
    GridIndex,
    KnownDisparity,
    KnownView,
    MultiView,
    maps_in,
    pictures_in,
    preferred_files,
)
from iibr_core.formats.light_fields.write import PARAMETERS_NAME
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

HCI_NAME = re.compile(r"input_cam(\d{1,9})$", re.IGNORECASE)
ROW_COLUMN_NAME = re.compile(r"v(\d{1,9})_u(\d{1,9})$")
NAMES = ((HCI_NAME, "input_Cam{:03d}"), (ROW_COLUMN_NAME, "v{:02d}_u{:02d}"))
"""Names of views by their numbers, for the error about a missing one."""
PLENO_NAME = re.compile(r"(\d{3})_(\d{3})\.ppm$", re.IGNORECASE)
MAP_WORDS = re.compile(r"disp|depth|mask|label|normal|edge|reliable", re.IGNORECASE)
MIN_SIDE = 9
"""Fewest rows of a square grid that only the number of its pictures suggests: 25 numbered photos are of a holiday."""


def read_grid(folder: Path) -> MultiView | None:
    """Return the views of a grid folder, None if its pictures are not numbered as a grid."""
    inside = folder / "views" if (folder / "views").is_dir() else folder
    layout, paths = _lay_out(folder, sorted(preferred_files(pictures_in(inside), PICTURE_EXTENSIONS).values()))
    if not paths:
        return None
    grid = GridShape(max(v for v, _ in paths) + 1, max(u for _, u in paths) + 1)
    _require_fitting(folder, grid, len(paths))
    missing = [at for at in _places(grid) if at not in paths]
    if missing:
        raise _missing_view(next(iter(paths.values())), missing, f"{grid.rows}x{grid.columns}")
    return _grid_scene(folder, f"{layout}, {grid.columns}x{grid.rows}", grid, paths)


def _lay_out(folder: Path, pictures: list[Path]) -> tuple[str, Mapping[GridIndex, Path]]:
    """Return the name of the layout, and the pictures by row and column: none if their names give no places."""
    if views := _by_numbers((path, match.groups()) for path in pictures if (match := HCI_NAME.match(path.stem))):
        return "HCI 4D light field", _row_by_row(folder, {number: path for (number,), path in views.items()}, True)
    views = _by_numbers((path, match.groups()) for path in pictures if (match := ROW_COLUMN_NAME.match(path.stem)))
    if not views and all(PLENO_NAME.match(path.name) for path in pictures):
        views = _from_least(_by_numbers((path, path.stem.split("_")[::-1]) for path in pictures))
    if views:
        return "grid folder", {(v, u): path for (v, u), path in views.items()}
    return "grid folder", _by_any_numbers(folder, [path for path in pictures if not MAP_WORDS.search(path.stem)])


def _by_numbers(numbered: Iterable[tuple[Path, Iterable[str]]]) -> dict[tuple[int, ...], Path]:
    views: dict[tuple[int, ...], Path] = {}
    for path, digits in numbered:
        numbers = tuple(map(int, digits))
        if numbers in views:
            raise InputError(f"{path}: shows the same view as {views[numbers].name}; remove one of them")
        views[numbers] = path
    return views


def _from_least(views: Mapping[tuple[int, ...], Path]) -> dict[tuple[int, ...], Path]:
    """Return the views with each number counted from its least."""
    least = [min(axis) for axis in zip(*views)]
    return {tuple(n - first for n, first in zip(numbers, least)): path for numbers, path in views.items()}


def _by_any_numbers(folder: Path, pictures: list[Path]) -> Mapping[GridIndex, Path]:
    """Return pictures by the two numbers that vary among their names; if one number varies, row by row.

    Photos that are numbered by date and time fill less than half of such a grid.
    """
    kinds = {re.sub(r"\d+", "#", path.stem.lower()) for path in pictures}
    digits = {path: re.findall(r"\d{1,9}", path.stem) for path in pictures}
    if len(pictures) < 2 or len(kinds) != 1 or len(set(map(len, digits.values()))) != 1:
        return {}
    varying = [k for k, values in enumerate(zip(*digits.values())) if len(set(map(int, values))) > 1]
    if len(varying) not in (1, 2):
        return {}
    views = _by_numbers((path, [numbers[k] for k in varying]) for path, numbers in digits.items())
    if len(varying) == 1:
        return _row_by_row(folder, {number: path for (number,), path in views.items()}, False)
    views = _from_least(views)
    rows, columns = (max(axis) + 1 for axis in zip(*views))
    return {(v, u): path for (v, u), path in views.items()} if rows * columns <= 2 * len(views) else {}


def _row_by_row(folder: Path, pictures: Mapping[int, Path], is_named: bool) -> dict[GridIndex, Path]:
    """Return pictures that are numbered row by row, on the grid that parameters.cfg states, else on a square one.

    is_named: whether their names are those of a light field; else they must form a large square. Where most numbers are
    left out, as where every tenth view was kept, no view counts as missing.
    """
    count, side, parameters = len(pictures), math.isqrt(len(pictures)), read_parameters(folder)
    cameras = GridShape(int(parameters.get("num_cams_y", 0)), int(parameters.get("num_cams_x", 0)))
    stated = cameras if any(cameras) else None
    if stated is None and not is_named and (side < MIN_SIDE or side**2 != count):
        return {}
    numbers = sorted(pictures)
    if stated is not None:
        _require_fitting(folder, stated, count)
    span = range(numbers[0], numbers[-1] + 1)
    missing = sorted(set(span) - set(numbers)) if len(span) < 2 * count else []
    if stated is not None and (missing or count < stated.rows * stated.columns):
        missing = sorted(set(range(stated.rows * stated.columns)) - set(numbers))
    if missing:
        total = f"{stated.rows}x{stated.columns}" if stated else f"{count + len(missing)}"
        raise _missing_view(pictures[numbers[0]], [(number,) for number in missing], total)
    if stated is None and side**2 != count:
        raise InputError(
            f"{folder}: {count} views do not form a square grid; state num_cams_x and num_cams_y in parameters.cfg"
        )
    return {divmod(k, stated.columns if stated else side): pictures[number] for k, number in enumerate(numbers)}


def _require_fitting(folder: Path, grid: GridShape, count: int) -> None:
    """Raise InputError if the grid has too few places, or more than half of them are empty."""
    if min(grid) < 1 or not count <= grid.rows * grid.columns <= 2 * count:
        raise InputError(
            f"{folder}: {count} views do not fit a grid of {grid.rows}x{grid.columns}; correct names or parameters.cfg"
        )


def _missing_view(picture: Path, missing: Sequence[tuple[int, ...]], total: str) -> InputError:
    """Return the error about missing views, by row and column or by number. picture: one that is there."""
    stem = next((name.format(*missing[0]) for pattern, name in NAMES if pattern.match(picture.stem)), None)
    place = ("view {}" if len(missing[0]) == 1 else "the view in row {}, column {}").format(*missing[0])
    path, view = (picture.with_stem(stem), "this view") if stem else (picture.parent, place)
    return InputError(f"{path}: {view} is missing ({len(missing)} of {total} views are); get the whole data set")


def _places(grid: GridShape) -> list[GridIndex]:
    return [(v, u) for v in range(grid.rows) for u in range(grid.columns)]


def _grid_scene(folder: Path, layout: str, grid: GridShape, paths: Mapping[GridIndex, Path]) -> MultiView:
    places = _places(grid)
    views = tuple(
        KnownView(f"v{v:02d} u{u:02d}", ViewOffset(float(v), float(u)), PictureSource(paths[v, u]), place=(v, u))
        for v, u in places
    )
    parameters = read_parameters(folder)
    focal_px = stated_focal_px(parameters, read_size(views[0].path)) if parameters else None
    whole = folder.resolve()
    low, high = (parameters.get(name, math.nan) for name in ("disp_min", "disp_max"))
    return MultiView(
        whole.parent.name if whole.name == "views" else whole.name,
        layout,
        views,
        {places.index(at): known for at, known in _maps(folder, grid).items()},
        (low, high) if low <= high else None,
        grid=grid,
        focal_px=focal_px,
        infinity_px=_stated_infinity_px(parameters, focal_px),
    )


def _maps(folder: Path, grid: GridShape) -> dict[GridIndex, KnownDisparity]:
    maps = maps_in(folder)
    known: dict[GridIndex, KnownDisparity] = {}
    for k, (v, u) in enumerate(_places(grid)):
        truth = maps.get(f"gt_disp_u{u:02d}_v{v:02d}") or maps.get(f"gt_disp_lowres_Cam{k:03d}")
        estimate = maps.get(f"disp_est_u{u:02d}_v{v:02d}") or maps.get(f"disp_Cam{k:03d}")
        if path := truth or estimate:
            known[v, u] = KnownDisparity(path, is_truth=truth is not None)
    if grid.centre not in known and (path := maps.get("gt_disp_lowres") or _only_map(folder)):
        known[grid.centre] = KnownDisparity(path)
    return known


def _only_map(folder: Path) -> Path | None:
    """Return the one file that looks like the centre view's map; None if there are several or none."""
    kinds = (".pfm", ".npy", ".exr")
    maps = [path for path in entries_of(folder) if "disp" in path.stem.lower() and path.suffix.lower() in kinds]
    return maps[0] if len(maps) == 1 and not re.search(r"\d", maps[0].stem) else None


def read_parameters(folder: Path) -> dict[str, float]:
    """Return every finite number of the folder's parameters by name, whatever its section; empty without a file."""
    path = folder / PARAMETERS_NAME
    if not path.is_file() or path.stat().st_size == 0:
        return {}
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string(read_text(path))
    except configparser.Error as error:
        raise InputError(f"{path}: is not a valid parameter file ({reason_of(error)}); correct or remove it") from error
    numbers: dict[str, float] = {}
    for section in parser.sections():
        for name, text in parser.items(section):
            with suppress(ValueError):
                if math.isfinite(number := float(text)):
                    numbers[name] = number
    return numbers


def stated_focal_px(parameters: Mapping[str, float], size: ImageSize) -> float | None:
    """Return the focal length in pixels of a view of this size; None if it is not stated or makes no sense."""
    focal_mm, sensor_mm = parameters.get("focal_length_mm", 0.0), parameters.get("sensor_size_mm", 0.0)
    if focal_mm > 0 and sensor_mm > 0 and math.isfinite(focal_px := focal_mm / sensor_mm * max(size)):
        return focal_px
    return None


def _stated_infinity_px(parameters: Mapping[str, float], focal_px: float | None) -> float | None:
    """Return the disparity of infinitely far points; None if it is not stated or makes no sense."""
    baseline_mm, focus_m = parameters.get("baseline_mm", 0.0), parameters.get("focus_distance_m", 0.0)
    if focal_px is None or baseline_mm <= 0 or focus_m <= 0:
        return None
    infinity_px = -focal_px * baseline_mm / (1000 * focus_m)
    return round(infinity_px, 3) if math.isfinite(infinity_px) else None
