"""Light fields as folders, laid out as in the HCI 4D Light Field Benchmark (Honauer et al., ACCV 2016).

`input_Cam000.png` .. row by row (v * columns + u), `gt_disp_lowres.pfm` for the centre view, `disp_Cam000.pfm` .. for
every view where wanted, `parameters.cfg`. HDR views are half-float EXR (linear light) instead of PNG. Reading also
knows HCI's `gt_disp_lowres_Cam000.pfm` and other kinds of pictures and maps.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from threading import Semaphore
from types import TracebackType

import numpy as np

from iibr_core.formats.files import entries_of, is_folder
from iibr_core.formats.light_fields.parameters import read_parameters, stated_grid, write_parameters
from iibr_core.formats.light_fields.scene import MultiView
from iibr_core.formats.light_fields.view_grid import (
    candidate_views,
    grid_scene,
    missing_view,
    require_fitting,
    set_view,
)
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.outputs import UnfinishedFolder, remove_leftovers, require_folder_place
from iibr_core.types import GridShape, ImageSize, InputError, ViewUpdate, image_size

CAM_NAME = re.compile(r"input_cam(\d{1,9})$", re.IGNORECASE)
OWN_FILE = re.compile(r"input_Cam\d+\.(png|exr)|disp_Cam\d+\.pfm|gt_disp_lowres\.pfm|parameters\.cfg")
WRITING_THREADS = 2
PENDING_VIEWS = 4


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
        self._writing = Semaphore(WRITING_THREADS)
        self._is_over = False

    @staticmethod
    def require_place(folder: Path, inputs: Iterable[Path] = (), may_replace: bool = False) -> None:
        """Raise InputError as `require_folder_place` does, and where the folder holds anything but a light field."""
        if is_folder(folder):
            remove_leftovers(folder)
            foreign = next((file.name for file in entries_of(folder) if not OWN_FILE.fullmatch(file.name)), None)
            if foreign is not None:
                raise InputError(f"{folder}: holds other files ({foreign}); choose an empty or new folder with --out")
        require_folder_place(folder, inputs, may_replace, is_whole=True)

    def __enter__(self) -> HciWriter:
        """Make the temporary folder."""
        self.require_place(self.folder, may_replace=True)
        self._unfinished = UnfinishedFolder(self.folder)
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
            self._end_writing()
            self._unfinished.discard()

    def _end_writing(self) -> None:
        """Wait for what is being written: the pool knows no thread that an interruption struck while it began."""
        self._is_over = True
        for _ in range(WRITING_THREADS):
            self._writing.acquire()

    def _finish(self) -> None:
        for pending in self._pending:
            pending.result()
        total = self.grid.rows * self.grid.columns
        if len(self._added) != total:
            raise InputError(f"{self.folder}: only {len(self._added)} of {total} views were made; nothing was written")
        write_parameters(self._unfinished.path, self.name, self.grid, self._size, self.focal_px, self._range)
        self._unfinished.put_in_place()

    def _write(self, update: ViewUpdate) -> None:
        try:
            with self._writing:
                if not self._is_over:
                    self._write_view(update)
        except InputError as error:  # the temporary folder's name says nothing to people
            raise InputError(str(error).replace(str(self._unfinished.path), str(self.folder))) from error

    def _write_view(self, update: ViewUpdate) -> None:
        from iibr_core.formats.images.photo import write_image  # brings numba, for which no refusal should wait

        index = update.row * self.grid.columns + update.column
        extension = ".png" if update.colors.dtype == np.uint8 else ".exr"
        write_image(self._unfinished.path / f"input_Cam{index:03d}{extension}", update.colors)
        if update.disparity is None:
            return
        if self.with_disparity:
            write_pfm(self._unfinished.path / f"disp_Cam{index:03d}.pfm", update.disparity)
        if (update.row, update.column) == self.grid.centre:
            write_pfm(self._unfinished.path / "gt_disp_lowres.pfm", update.disparity)


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
            f"{folder}: {len(pictures)} views are no square grid; say num_cams_x and num_cams_y in parameters.cfg"
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
