"""Light fields as folders, laid out as in the HCI 4D Light Field Benchmark (Honauer et al., ACCV 2016).

`input_Cam000.png` .. row by row (v * columns + u), `gt_disp_lowres.pfm` for the centre view, `disp_Cam000.pfm` .. for
every view where wanted, `parameters.cfg`. HDR views are half-float EXR (linear light) instead of PNG. Reading also
knows HCI's `gt_disp_lowres_Cam000.pfm`, JPEG views, and folders of `v00_u00.png` ...
"""

from __future__ import annotations

import configparser
import math
import re
import shutil
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.formats.files import open_binary, temporary_sibling
from iibr_core.formats.images.oiio_reader import read_size
from iibr_core.formats.images.photo import focal_px_from_fov, read_photo, write_image
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.pfm import MAX_FILE_PIXELS, write_pfm
from iibr_core.types import FloatImage, GridShape, ImageSize, InputError, StoredColors, ViewUpdate, image_size

VIEW_EXTENSIONS = (".png", ".jpg", ".jpeg", ".exr")
CAM_NAME = re.compile(r"input_Cam(\d{2,6})$")
GRID_NAME = re.compile(r"v(\d{1,4})_u(\d{1,4})$")
OWN_FILE = re.compile(r"input_Cam\d+\.(png|exr)|disp_Cam\d+\.pfm|gt_disp_lowres\.pfm|parameters\.cfg")
MOST_PARAMETER_BYTES = 1 << 20
SENSOR_SIZE_MM = 36.0
WRITING_THREADS = 2
PENDING_VIEWS = 4


@dataclass(frozen=True)
class LightFieldHeader:
    """What is known of a light field before its views are read.

    focal_px: in pixels of a view. disparity_range_px: least and greatest disparity (px per view step), or None.
    """

    name: str
    grid: GridShape
    width: int
    height: int
    focal_px: float
    disparity_range_px: tuple[float, float] | None
    is_hdr: bool


class HciWriter:
    """Writes the views of a light field as they come; the folder appears, whole, when the `with` block ends well.

    Nothing is left behind if the block ends with an exception or before every view was added. Raises InputError where
    `folder` may not be written or holds anything but a light field written before; such a one is replaced.
    """

    def __init__(self, folder: Path, grid: GridShape, focal_px: float, name: str, with_disparity: bool = False) -> None:
        self.folder = Path(folder).absolute()
        self.grid = grid
        self.focal_px = focal_px
        self.name = name
        self.with_disparity = with_disparity
        self._added: set[tuple[int, int]] = set()
        self._size = ImageSize(0, 0)
        self._range = (math.inf, -math.inf)
        self._pending: list[Future[None]] = []

    def __enter__(self) -> HciWriter:
        """Make the temporary folder."""
        _require_replaceable(self.folder)
        self._made_parents = [parent for parent in self.folder.parents if not parent.exists()]
        self._temporary = temporary_sibling(self.folder)
        try:
            self._temporary.mkdir(parents=True)
        except OSError as error:
            self._remove_traces()
            raise InputError(
                f"{self.folder}: cannot be created ({error.strerror}); choose another place with --out"
            ) from error
        self._pool = ThreadPoolExecutor(WRITING_THREADS, thread_name_prefix="hci-writer")
        return self

    def add(self, update: ViewUpdate) -> None:
        """Write one view; returns once at most PENDING_VIEWS wait. Raises InputError if an earlier one failed."""
        size = image_size(update.colors)
        if self._added and size != self._size:
            raise ValueError(f"view ({update.row}, {update.column}) is {size}, the others are {self._size}")
        if (update.row, update.column) in self._added:
            raise ValueError(f"view ({update.row}, {update.column}) was added before")
        self._size = size
        self._added.add((update.row, update.column))
        if update.disparity is not None:
            low, high = float(update.disparity.min()), float(update.disparity.max())
            self._range = (min(self._range[0], low), max(self._range[1], high))
        self._pending.append(self._pool.submit(self._write, update))
        while len(self._pending) > PENDING_VIEWS:
            self._pending.pop(0).result()

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the folder in its place, or remove it."""
        try:
            self._pool.shutdown(wait=True, cancel_futures=kind is not None)
            if kind is None:
                self._finish()
        finally:
            self._remove_traces()

    def _remove_traces(self) -> None:
        """Remove what is still temporary, and parent folders made for it; nothing if the folder is in its place."""
        shutil.rmtree(self._temporary, ignore_errors=True)
        for parent in self._made_parents:
            with suppress(OSError):  # not empty: the light field is in it
                parent.rmdir()

    def _finish(self) -> None:
        for pending in self._pending:
            pending.result()
        total = self.grid.rows * self.grid.columns
        if len(self._added) != total:
            raise InputError(f"{self.folder}: only {len(self._added)} of {total} views were made; nothing was written")
        _write_parameters(
            self._temporary / "parameters.cfg", self.name, self.grid, self._size, self.focal_px, self._range
        )
        _replace_folder(self._temporary, self.folder)

    def _write(self, update: ViewUpdate) -> None:
        try:
            self._write_view(update)
        except InputError as error:  # the temporary folder's name says nothing to people
            raise InputError(str(error).replace(str(self._temporary), str(self.folder))) from error

    def _write_view(self, update: ViewUpdate) -> None:
        index = update.row * self.grid.columns + update.column
        extension = ".png" if update.colors.dtype == np.uint8 else ".exr"
        write_image(self._temporary / f"input_Cam{index:03d}{extension}", update.colors)
        if update.disparity is None:
            return
        if self.with_disparity:
            write_pfm(self._temporary / f"disp_Cam{index:03d}.pfm", update.disparity)
        if (update.row, update.column) == self.grid.centre:
            write_pfm(self._temporary / "gt_disp_lowres.pfm", update.disparity)


def is_light_field_folder(path: Path) -> bool:
    """Whether `path` is a folder that holds views of a light field."""
    path = Path(path)
    return path.is_dir() and any(_is_view(file) for file in path.iterdir())


def read_light_field(folder: Path) -> tuple[LightFieldHeader, Iterator[ViewUpdate]]:
    """The header of a light-field folder, and its views: the centre first, then the nearest to it.

    The grid comes from parameters.cfg, else from the file names, else a square is assumed. Raises InputError, naming
    the file, where a view is missing, unreadable, or of another size; names and sizes are checked before anything is
    yielded.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder")
    views, parameters = _find_views(folder), _read_parameters(folder / "parameters.cfg")
    paths, grid = _as_grid(folder, views, parameters)
    size = read_size(paths[0])
    for path in paths:
        if (found := read_size(path)) != size:
            raise InputError(f"{path}: is {found}, but {paths[0].name} is {size}")
    is_hdr = any(path.suffix.lower() == ".exr" for path in paths)
    header = LightFieldHeader(
        folder.resolve().name,
        grid,
        size.width,
        size.height,
        _focal_px(parameters, size),
        _disparity_range(parameters),
        is_hdr,
    )
    return header, _iterate_views(folder, header, paths)


def read_view(folder: Path, row: int, column: int) -> StoredColors:
    """Colours (H, W, 3) of one view of a light-field folder, read alone. Raises InputError like `read_light_field`."""
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder")
    paths, grid = _as_grid(folder, _find_views(folder), _read_parameters(folder / "parameters.cfg"))
    if not (0 <= row < grid.rows and 0 <= column < grid.columns):
        raise InputError(f"{folder}: has {grid.rows}x{grid.columns} views, none in row {row}, column {column}")
    path = paths[row * grid.columns + column]
    return stored_from_encoded(read_photo(path, MAX_FILE_PIXELS).pixels, path.suffix.lower() == ".exr")


def _iterate_views(folder: Path, header: LightFieldHeader, paths: list[Path]) -> Iterator[ViewUpdate]:
    indices = [(row, column) for row in range(header.grid.rows) for column in range(header.grid.columns)]
    for row, column in sorted(indices, key=lambda index: math.hypot(*header.grid.offset(*index))):
        index = row * header.grid.columns + column
        encoded = read_photo(paths[index], MAX_FILE_PIXELS).pixels
        if encoded.shape[:2] != (header.height, header.width):
            raise InputError(f"{paths[index]}: is rotated by its Exif orientation; views must be stored upright")
        disparity = _read_view_disparity(folder, header, index)
        yield ViewUpdate(row, column, stored_from_encoded(encoded, header.is_hdr), disparity)


def _read_view_disparity(folder: Path, header: LightFieldHeader, index: int) -> FloatImage | None:
    names = [f"disp_Cam{index:03d}.pfm", f"gt_disp_lowres_Cam{index:03d}.pfm"]
    centre_row, centre_column = header.grid.centre
    if index == centre_row * header.grid.columns + centre_column:
        names.append("gt_disp_lowres.pfm")
    for name in names:
        if (folder / name).is_file():
            return read_disparity(folder / name, ImageSize(header.height, header.width)).values
    return None


def _is_view(path: Path) -> bool:
    named = CAM_NAME.match(path.stem) or GRID_NAME.match(path.stem)
    return named is not None and path.suffix.lower() in VIEW_EXTENSIONS


def _find_views(folder: Path) -> dict[tuple[int, ...], Path]:
    """Views by what their names say: (index,) for input_Cam names, else (v, u)."""
    files = sorted((file for file in folder.iterdir() if _is_view(file)), key=_view_order)
    if not files:
        raise InputError(f"{folder}: holds no light field (no input_Cam000.png or v00_u00.png ...)")
    pattern = CAM_NAME if CAM_NAME.match(files[0].stem) else GRID_NAME
    views: dict[tuple[int, ...], Path] = {}
    for file in files:
        if match := pattern.match(file.stem):
            views.setdefault(tuple(int(number) for number in match.groups()), file)
    return views


def _view_order(path: Path) -> tuple[bool, int, str]:
    """input_Cam names before grid names; of two files for one view, the extension listed first."""
    return CAM_NAME.match(path.stem) is None, VIEW_EXTENSIONS.index(path.suffix.lower()), path.name


def _as_grid(
    folder: Path, views: dict[tuple[int, ...], Path], parameters: dict[str, float]
) -> tuple[list[Path], GridShape]:
    """Paths row by row, and the grid. Raises InputError naming the first view that is missing."""
    names: dict[tuple[int, ...], str]
    if len(next(iter(views))) == 2:
        grid = GridShape(max(v for v, _ in views) + 1, max(u for _, u in views) + 1)
        _require_plausible(folder, grid, len(views))
        names = {(v, u): f"v{v:02d}_u{u:02d}" for v in range(grid.rows) for u in range(grid.columns)}
    else:
        grid = _cam_grid(folder, len(views), parameters)
        names = {(index,): f"input_Cam{index:03d}" for index in range(grid.rows * grid.columns)}
    missing = [name for key, name in names.items() if key not in views]
    if missing:
        raise InputError(
            f"{folder / missing[0]}{next(iter(views.values())).suffix}: this view is missing "
            f"({len(missing)} of {grid.rows}x{grid.columns} views are)"
        )
    return [views[key] for key in names], grid


def _cam_grid(folder: Path, count: int, parameters: dict[str, float]) -> GridShape:
    rows, columns = int(parameters.get("num_cams_y", 0)), int(parameters.get("num_cams_x", 0))
    if rows == 0 and columns == 0:
        rows = columns = math.isqrt(count)
        if rows * columns != count:
            raise InputError(
                f"{folder}: {count} views are no square grid; say num_cams_x and num_cams_y in parameters.cfg"
            )
    grid = GridShape(rows, columns)
    _require_plausible(folder, grid, count)
    return grid


def _require_plausible(folder: Path, grid: GridShape, count: int) -> None:
    """Some views may be missing, which is said by name; half of them, or too many, mean that the grid is wrong."""
    if grid.rows < 1 or grid.columns < 1 or not count <= grid.rows * grid.columns <= 2 * count:
        raise InputError(
            f"{folder}: {count} views do not fit a grid of {grid.rows}x{grid.columns}; correct names or parameters.cfg"
        )


def _read_parameters(path: Path) -> dict[str, float]:
    """Every number of the file by name, whatever its section; empty if there is no file."""
    if not path.is_file() or path.stat().st_size == 0:
        return {}
    with open_binary(path) as file:
        data = file.read(MOST_PARAMETER_BYTES + 1)
    if len(data) > MOST_PARAMETER_BYTES:
        raise InputError(f"{path}: more than {MOST_PARAMETER_BYTES:,} bytes are no parameters; correct or remove it")
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string(data.decode("utf-8-sig"))
    except (configparser.Error, UnicodeDecodeError) as error:
        reason = str(error).partition("\n")[0]
        raise InputError(f"{path}: cannot be read as parameters ({reason}); correct or remove it") from error
    numbers: dict[str, float] = {}
    for section in parser.sections():
        for key, text in parser.items(section):
            with suppress(ValueError):
                if math.isfinite(number := float(text)):
                    numbers[key] = number
    return numbers


def _write_parameters(
    path: Path, name: str, grid: GridShape, size: ImageSize, focal_px: float, disparity_range: tuple[float, float]
) -> None:
    """The benchmark's parameters.cfg. One photo tells no baseline: 1 mm by decree, which fixes the scale of depths."""
    low, high = disparity_range if math.isfinite(disparity_range[0]) else (0.0, 0.0)
    # Farthest point at infinity; 0 says that the cameras are focused there too.
    focus_m = focal_px / -low / 1000 if low < 0 else 0.0
    parser = configparser.ConfigParser(interpolation=None)
    parser["intrinsics"] = {
        "focal_length_mm": repr(focal_px * SENSOR_SIZE_MM / max(size)),
        "image_resolution_x_px": str(size.width),
        "image_resolution_y_px": str(size.height),
        "sensor_size_mm": repr(SENSOR_SIZE_MM),
        "fstop": "100.0",
    }
    parser["extrinsics"] = {
        "num_cams_x": str(grid.columns),
        "num_cams_y": str(grid.rows),
        "baseline_mm": "1.0",
        "focus_distance_m": repr(focus_m),
        **{f"center_cam_{axis}": "0.0" for axis in ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")},
        "offset": "0",
    }
    parser["meta"] = {
        "scene": " ".join(name.split()),
        "category": "iibr",
        "disp_min": repr(low),
        "disp_max": repr(high),
        "depth_map_scale": "1.0",
    }
    with path.open("w", encoding="utf-8") as file:
        parser.write(file)


def _focal_px(parameters: dict[str, float], size: ImageSize) -> float:
    focal_mm, sensor_mm = parameters.get("focal_length_mm", 0.0), parameters.get("sensor_size_mm", 0.0)
    if focal_mm > 0 and sensor_mm > 0 and math.isfinite(focal_px := focal_mm / sensor_mm * max(size)):
        return focal_px
    return focal_px_from_fov(size.width)


def _disparity_range(parameters: dict[str, float]) -> tuple[float, float] | None:
    if "disp_min" in parameters and "disp_max" in parameters and parameters["disp_min"] <= parameters["disp_max"]:
        return parameters["disp_min"], parameters["disp_max"]
    return None


def _require_replaceable(folder: Path) -> None:
    """Raise InputError where writing `folder` would destroy something that is not a light field of ours."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; --out names a folder")
    if not folder.is_dir():
        return
    foreign = next((file.name for file in folder.iterdir() if not OWN_FILE.fullmatch(file.name)), None)
    if foreign is not None:
        raise InputError(f"{folder}: holds other files ({foreign}); choose an empty or new folder with --out")


def _replace_folder(source: Path, target: Path) -> None:
    old = temporary_sibling(target)
    try:
        if target.exists():
            target.rename(old)
        source.rename(target)
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        if old.exists() and not target.exists():
            old.rename(target)
        raise InputError(f"{target}: cannot be replaced ({error.strerror}); choose another place") from error
