"""Folders of views on a grid: HCI's `input_Cam000.png` (Honauer et al., ACCV 2016), `v00_u00.png`, JPEG Pleno's
`000_000.ppm` (column, row), and other pictures that are numbered by row and column, or row by row.

Rows are counted downwards, columns to the right. Views may lie in a subfolder `views`. Maps lie beside it; they are
named as HCI's (`gt_disp_lowres.pfm` for the centre view, `gt_disp_lowres_Cam000.pfm`, estimates `disp_Cam000.pfm`) or
by place (`gt_disp_u00_v00.npy`, estimates `disp_est_u00_v00.npy`).
"""

import configparser
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from iibr_core.formats.files import entries_of, natural_key, parsing, read_text
from iibr_core.formats.images.open_picture import open_picture
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
NUMBER = re.compile(r"(?<![A-Za-z\d-])[-+]\d{1,9}|\d{1,9}")
"""Number in a name; views may be counted from the middle, as in `view_-1_+2`."""
MIN_VIEWS_PER_PREVIEW = 9
"""Fewest views for each picture of another name among them."""
MIN_FILLED = 0.8
"""Smallest share of a grid of rows and columns that pictures with any names fill."""
MAX_PLACES_PER_VIEW = 9
"""Largest number of places for each view in a grid of which views are missing; more come from misread names."""
MIN_SIDE = 9
"""Fewest rows of a square that only the number of its pictures suggests: 25 numbered photos may be of a holiday."""
GUESSED_VIEWS = 3, 1000
"""Fewest and most pictures of such a folder that may be a light field all the same."""


def read_grid(folder: Path) -> MultiView | None:
    """Return the views of a grid folder, None if its pictures are not numbered as a grid."""
    inside = _inside(folder)
    layout, views, is_guess = _lay_out(sorted(preferred_files(pictures_in(inside), PICTURE_EXTENSIONS).values()))
    parameters = read_parameters(folder)
    stated = _stated_grid(parameters)
    if not views:
        return None
    is_stated, is_row_by_row = not is_guess or stated is not None, len(next(iter(views))) == 1
    if is_row_by_row:
        if is_guess and stated is None and not _may_be_a_grid(views):
            return None
        views, grid = _in_order(folder, views, stated)
        side = math.isqrt(len(views))
        is_guess = not is_stated and (side < MIN_SIDE or side**2 != len(views))
    else:
        views = _without_gaps(_from_least(views) if is_guess else views)
        grid, is_guess = GridShape(*(max(axis) + 1 for axis in zip(*views))), False
        _require_fitting(folder, grid, len(views))
    missing = [at for at in _places(grid) if at not in views] if len(next(iter(views))) == 2 else []
    if missing and not _is_star(views, grid):
        raise _missing_view(next(iter(views.values())), missing, f"{grid.rows}x{grid.columns}")
    words = f"{layout}, {grid.columns}x{grid.rows}" + (f", {len(views)} views: a star" if missing else "")
    scene = _grid_scene(folder, words, grid, sorted(views.items()), parameters)
    return replace(scene, stated_grid=stated, is_guess=is_guess, is_stated=is_stated)


def read_in_grid(folder: Path, grid: GridShape | None) -> MultiView | None:
    """Return the pictures of a folder, by name, on a grid that the user states; None if they do not fill it.

    Without a grid they are a square, else one row.
    """
    pictures = sorted(preferred_files(pictures_in(_inside(folder)), PICTURE_EXTENSIONS).values(), key=natural_key)
    pictures = [path for path in pictures if not MAP_WORDS.search(path.stem)]
    grid = grid or _square_or_row(len(pictures))
    if len(pictures) != math.prod(grid) or len(pictures) < 2:
        return None
    layout = f"pictures by name, {grid.columns}x{grid.rows}"
    scene = _grid_scene(
        folder, layout, grid, [((k,), path) for k, path in enumerate(pictures)], read_parameters(folder)
    )
    return replace(scene, stated_grid=grid, is_stated=True)


def _inside(folder: Path) -> Path:
    return folder / "views" if (folder / "views").is_dir() else folder


Numbered = Mapping[tuple[int, ...], Path]
"""Pictures by their row and column, or by their number in one order."""


def _lay_out(pictures: list[Path]) -> tuple[str, Numbered, bool]:
    """Return the name of the layout, the pictures by numbers in their names, and whether names of photos may be such.

    There are none if names give no places.
    """
    if views := _by_numbers((path, match.groups()) for path in pictures if (match := HCI_NAME.match(path.stem))):
        return "HCI 4D light field", views, False
    views = _by_numbers((path, match.groups()) for path in pictures if (match := ROW_COLUMN_NAME.match(path.stem)))
    if not views and all(PLENO_NAME.match(path.name) for path in pictures):
        views = _from_least(_by_numbers((path, path.stem.split("_")[::-1]) for path in pictures))
    if views:
        return "grid folder", views, False
    return "grid folder", _by_any_numbers([path for path in pictures if not MAP_WORDS.search(path.stem)]), True


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


def _by_any_numbers(pictures: list[Path]) -> Numbered:
    """Return pictures by the one or two numbers that vary among their names; a preview among them does not count.

    Photos that are numbered by date and time, and pictures of several scenes, leave many places of a grid empty.
    """
    kinds = Counter(NUMBER.sub("#", path.stem.lower()) for path in pictures)
    kind, count = kinds.most_common(1)[0] if kinds else ("", 0)
    if count < 2 or len(pictures) - count > count // MIN_VIEWS_PER_PREVIEW:
        return {}
    digits = {path: NUMBER.findall(path.stem) for path in pictures if NUMBER.sub("#", path.stem.lower()) == kind}
    varying = [k for k, values in enumerate(zip(*digits.values())) if len(set(map(int, values))) > 1]
    if len(varying) not in (1, 2):
        return {}
    views = _by_numbers((path, [numbers[k] for k in varying]) for path, numbers in digits.items())
    sides = [max(axis) - min(axis) + 1 for axis in zip(*views)]
    return views if len(varying) == 1 or math.prod(sides) * MIN_FILLED <= len(views) else {}


def _without_gaps(views: Numbered) -> Numbered:
    """Return the views counted from 0 along each axis whose numbers have a constant step, as every second one."""
    ranks = []
    for axis in zip(*views):
        numbers = sorted(set(axis))
        is_even = len({b - a for a, b in pairwise(numbers)}) <= 1
        ranks.append({number: rank if is_even else number for rank, number in enumerate(numbers)})
    return {tuple(rank[n] for rank, n in zip(ranks, numbers)): path for numbers, path in views.items()}


def _is_star(views: Iterable[tuple[int, ...]], grid: GridShape) -> bool:
    """Return whether the views are the whole middle row and column of a grid, its diagonals, or all of these."""
    (v0, u0), there = ((length - 1) / 2 for length in grid), set(views)
    steps = [((v, u), abs(v - v0), abs(u - u0)) for v, u in _places(grid)]
    cross, diagonals = {at for at, t, s in steps if 0 in (t, s)}, {at for at, t, s in steps if t == s}
    return there in (cross, diagonals, cross | diagonals) and grid.rows == grid.columns


def _may_be_a_grid(views: Numbered) -> bool:
    """Return whether pictures that are numbered as photos may be a light field: none is missing between them."""
    numbers = [number for (number,) in _without_gaps(views)]
    return GUESSED_VIEWS[0] <= len(views) <= GUESSED_VIEWS[1] and max(numbers) - min(numbers) + 1 == len(views)


def _stated_grid(parameters: Mapping[str, float]) -> GridShape | None:
    """Return the grid that parameters.cfg states."""
    grid = GridShape(int(parameters.get("num_cams_y", 0)), int(parameters.get("num_cams_x", 0)))
    return grid if any(grid) else None


def _in_order(folder: Path, views: Numbered, stated: GridShape | None) -> tuple[Numbered, GridShape]:
    """Return pictures by their place in their order, and their grid: as stated, else a square or a single row.

    A part of a stated grid, or of a square that HCI's names fill, comes by row and column: every n-th row and column,
    or a star. Where most numbers are left out otherwise, no view counts as missing.
    """
    numbers, pictures = sorted(number for (number,) in views), {n: path for (n,), path in views.items()}
    evenly, count = {n: path for (n,), path in _without_gaps(views).items()}, len(views)
    span = range(min(evenly), max(evenly) + 1)
    whole = stated or (None if len(span) == count else _square_of_hci(pictures))
    if whole is not None and count < math.prod(whole):
        first = int(numbers[-1] >= math.prod(whole))  # numbers may be counted from 1
        placed = _without_gaps({divmod(number - first, whole.columns): pictures[number] for number in numbers})
        part = GridShape(*(max(axis) + 1 for axis in zip(*placed)))
        if math.prod(part) == count or _is_star(placed, part):
            return placed, part
        _require_fitting(folder, whole, count)
        missing = [n for n in range(first, first + math.prod(whole)) if n not in pictures]
        raise _missing_view(pictures[numbers[0]], [(n,) for n in missing], f"{whole.rows}x{whole.columns}")
    if stated is not None:
        _require_fitting(folder, stated, count)
    elif len(span) < 2 * count and (missing := [n for n in span if n not in evenly]):
        raise _missing_view(pictures[numbers[0]], [(n,) for n in missing], str(len(span)))
    return {(k,): pictures[number] for k, number in enumerate(numbers)}, stated or _square_or_row(count)


def _square_or_row(count: int) -> GridShape:
    side = math.isqrt(count)
    return GridShape(side, side) if side**2 == count else GridShape(1, count)


def _square_of_hci(pictures: Mapping[int, Path]) -> GridShape | None:
    """Return the square whose last view is there under HCI's name, which counts row by row from 0."""
    last = max(pictures)
    side = math.isqrt(last + 1)
    return GridShape(side, side) if side**2 == last + 1 and HCI_NAME.match(pictures[last].stem) else None


def _require_fitting(folder: Path, grid: GridShape, count: int) -> None:
    """Raise InputError if the grid has too few places, or most of them are empty."""
    if min(grid) < 1 or not count <= grid.rows * grid.columns <= MAX_PLACES_PER_VIEW * count:
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


def _grid_scene(
    folder: Path,
    layout: str,
    grid: GridShape,
    pictures: Sequence[tuple[tuple[int, ...], Path]],
    parameters: Mapping[str, float],
) -> MultiView:
    places = [(v, u) for v, u in (at if len(at) == 2 else divmod(at[0], grid.columns) for at, _ in pictures)]
    views = tuple(
        KnownView(f"v{v:02d} u{u:02d}", ViewOffset(float(v), float(u)), PictureSource(path), place=(v, u))
        for (v, u), (_, path) in zip(places, pictures)
    )
    focal_px = stated_focal_px(parameters, open_picture(views[0].path).size) if parameters else None
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
        numbers=tuple(at for at, _ in pictures),
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
    with parsing(path, "is not a valid parameter file ({}); correct or remove it", (configparser.Error,)):
        parser.read_string(read_text(path))
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
