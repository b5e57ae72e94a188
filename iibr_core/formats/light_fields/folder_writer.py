"""What writers of light fields as folders of views share, however they name them."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from threading import Semaphore
from types import TracebackType
from typing import Self

import numpy as np

from iibr_core.formats.files import entries_of, is_folder
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.outputs import check_output_folder, write_folder
from iibr_core.types import GridShape, ImageSize, InputError, ViewUpdate, image_size

WRITING_THREADS = 2
PENDING_VIEWS = 4


class FolderWriter(ABC):
    """Writes the views of a light field as they come; the folder appears, whole, when the `with` block ends well.

    Nothing is left behind if the block ends with an exception or before every view was added. Raises InputError where
    `folder` may not be written or holds anything but a light field written before; such a one is replaced.
    """

    own_file: re.Pattern[str]
    """Names of what it writes."""

    def __init__(self, folder: Path, grid: GridShape, focal_px: float, name: str, with_disparity: bool = False) -> None:
        self.folder = Path(folder).absolute()
        self.grid = grid
        self.focal_px = focal_px
        self.name = name
        self.with_disparity = with_disparity
        self._added: set[tuple[int, int]] = set()
        self.size = ImageSize(0, 0)
        self.range_px = (math.inf, -math.inf)
        self._pending: list[Future[None]] = []
        self._writing = Semaphore(WRITING_THREADS)
        self._is_over = False

    @classmethod
    def require_place(cls, folder: Path, inputs: Iterable[Path] = (), may_replace: bool = False) -> None:
        """Raise InputError as `check_output_folder` does, and where the folder holds anything but a light field."""
        cls._require_own(folder)
        check_output_folder(folder, inputs, may_replace)

    @classmethod
    def _require_own(cls, folder: Path) -> None:
        if not is_folder(folder):
            return
        foreign = next((file.name for file in entries_of(folder) if not cls.own_file.fullmatch(file.name)), None)
        if foreign is not None:
            raise InputError(f"{folder}: holds other files ({foreign}); choose an empty or new folder with --out")

    def __enter__(self) -> Self:
        """Make the temporary folder."""
        self._require_own(self.folder)
        self._stack = ExitStack()
        self._unfinished = self._stack.enter_context(write_folder(self.folder))
        self._pool = ThreadPoolExecutor(WRITING_THREADS, thread_name_prefix="view-writer")
        return self

    def add(self, update: ViewUpdate) -> None:
        """Write one view; returns once at most PENDING_VIEWS wait. Raises InputError if an earlier one failed."""
        size = image_size(update.colors)
        if self._added and size != self.size:
            raise ValueError(f"view ({update.row}, {update.column}) is {size}, the others are {self.size}")
        if (update.row, update.column) in self._added:
            raise ValueError(f"view ({update.row}, {update.column}) was added before")
        self.size = size
        self._added.add((update.row, update.column))
        if update.disparity is not None:
            low, high = float(update.disparity.min()), float(update.disparity.max())
            self.range_px = (min(self.range_px[0], low), max(self.range_px[1], high))
        self._pending.append(self._pool.submit(self._write, update))
        while len(self._pending) > PENDING_VIEWS:
            self._pending.pop(0).result()

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Put the folder in its place, or remove it."""
        with self._stack:
            self._pool.shutdown(wait=True, cancel_futures=kind is not None)
            self._end_writing()
            if value is not None:
                raise value
            self._finish()

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
        self.finish_folder(self._unfinished)

    def _write(self, update: ViewUpdate) -> None:
        try:
            with self._writing:
                if not self._is_over:
                    self._write_view(update)
        except InputError as error:  # the temporary folder's name says nothing to people
            raise InputError(str(error).replace(str(self._unfinished), str(self.folder))) from error

    def _write_view(self, update: ViewUpdate) -> None:
        from iibr_core.formats.images.photo import write_image  # brings numba, for which no refusal should wait

        extension = ".png" if update.colors.dtype == np.uint8 else ".exr"
        folder = self._unfinished
        view = folder / self.view_name(update.row, update.column, extension)
        view.parent.mkdir(exist_ok=True)
        write_image(view, update.colors)
        if update.disparity is None:
            return
        is_centre = (update.row, update.column) == self.grid.centre
        for name in self.map_names(update.row, update.column, self.with_disparity, is_centre):
            write_pfm(folder / name, update.disparity)

    @abstractmethod
    def view_name(self, row: int, column: int, extension: str) -> str:
        """Where a view goes in the folder."""

    @abstractmethod
    def map_names(self, row: int, column: int, is_wanted: bool, is_centre: bool) -> tuple[str, ...]:
        """Where its disparity goes. is_wanted: whether every view's is."""

    def finish_folder(self, folder: Path) -> None:  # noqa: B027  (most have nothing more to say)
        """Write what is known once every view is there."""
