"""Light fields as one file: all views in a lenslet image (ESLF), or as the parts of an OpenEXR file.

Views come in any order, such files are written in one: meanwhile they lie in a temporary file.
"""

from __future__ import annotations

import re
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored, linear_from_srgb
from iibr_core.formats.outputs import check_output
from iibr_core.types import FloatImage, GridShape, ImageSize, InputError, StoredColors, ViewUpdate, image_size

LENSLET_TAG = re.compile(r"_eslf$", re.IGNORECASE)
"""At the end of a lenslet image's name."""
LENSLET_KEY = "iibr:Lenslet"
"""In a lenslet image's header: columns and rows of each lens's pixels, which only ours tell."""


class _FileWriter(ABC):
    """Writes all views to one file when the `with` block ends well; raises InputError where some are missing."""

    ending: str

    def __init__(self, path: Path, grid: GridShape, focal_px: float, name: str, with_disparity: bool = False) -> None:
        self.path = Path(path)
        self.grid = grid
        self.with_disparity = with_disparity
        self.size = ImageSize(0, 0)
        self._dtype: np.dtype[Any] = np.dtype(np.uint8)
        self._has_disparity: set[tuple[int, int]] = set()
        self._added: set[tuple[int, int]] = set()
        self._views: IO[bytes] | None = None

    @classmethod
    def require_place(cls, path: Path, inputs: Iterable[Path] = (), may_replace: bool = False) -> None:
        """Raise InputError as `check_output` does, and for another ending."""
        if not path.name.lower().endswith(cls.ending):
            raise InputError(f"{path}: a light field in one file must end in {cls.ending}")
        check_output(path, inputs, may_replace)

    def __enter__(self) -> Self:
        self._views = tempfile.TemporaryFile()
        return self

    def add(self, update: ViewUpdate) -> None:
        """Keep one view. Raises InputError where there is no room for it."""
        if not self._added:
            self.size, self._dtype = image_size(update.colors), update.colors.dtype
        at = update.row, update.column
        if at in self._added or image_size(update.colors) != self.size:
            raise ValueError(f"view {at} was added before, or is {image_size(update.colors)}, not {self.size}")
        self._added.add(at)
        assert self._views is not None
        try:
            self._views.seek(self._start(*at))
            self._views.write(np.ascontiguousarray(update.colors).tobytes())
            if self.with_disparity and update.disparity is not None:
                self._views.write(np.ascontiguousarray(update.disparity, np.float32).tobytes())
                self._has_disparity.add(at)
            self._views.flush()
        except OSError as error:
            with suppress(OSError):  # what found no room is tried once more
                self._views.close()
            raise InputError(f"{self.path}: no room for its views ({error.strerror or error}); free some") from error

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._views is not None
        with closing(self._views):
            total = self.grid.rows * self.grid.columns
            if kind is None and len(self._added) != total:
                raise InputError(
                    f"{self.path}: only {len(self._added)} of {total} views were made; nothing was written"
                )
            if kind is None:
                self.write_file()

    @abstractmethod
    def write_file(self) -> None:
        """Write all views, see `view`. Raises InputError."""

    def places(self) -> Iterator[tuple[int, int]]:
        """Row and column of every view, row by row."""
        return ((row, column) for row in range(self.grid.rows) for column in range(self.grid.columns))

    def view(self, row: int, column: int) -> tuple[StoredColors, FloatImage | None]:
        """Colours (H, W, 3) and disparity (H, W) of a view that was added."""
        assert self._views is not None
        self._views.seek(self._start(row, column))
        height, width = self.size
        count = height * width
        colors = np.frombuffer(self._views.read(3 * count * self._dtype.itemsize), self._dtype)
        known = (row, column) in self._has_disparity
        disparity = np.frombuffer(self._views.read(4 * count), np.float32).reshape(self.size) if known else None
        return colors.reshape(height, width, 3), disparity

    def _start(self, row: int, column: int) -> int:
        each = self.size.height * self.size.width * (3 * self._dtype.itemsize + 4)
        return (row * self.grid.columns + column) * each


class EslfWriter(_FileWriter):
    """Writes a lenslet image, as the Stanford Lytro archive has them: the pixels that look at one place of the scene,
    one of each view, lie together as a rectangle of rows x columns. It has no place for disparity.
    """

    ending = "_eslf.png"

    def write_file(self) -> None:
        """8 bits a channel."""
        from iibr_core.formats.images.photo import write_image

        rows, columns = self.grid
        height, width = self.size
        whole: NDArray[Any] = np.empty((height, rows, width, columns, 3), self._dtype)
        for row, column in self.places():
            whole[:, row, :, column] = self.view(row, column)[0]
        pixels = whole.reshape(height * rows, width * columns, 3)
        stored = pixels if pixels.dtype == np.uint8 else encoded_from_stored(pixels)
        write_image(self.path, stored, {LENSLET_KEY: f"{columns}x{rows}"})


class ExrWriter(_FileWriter):
    """Writes an OpenEXR file with a part a view, v00_u00 and so on: linear light as half floats, disparity as float."""

    ending = ".exr"

    def write_file(self) -> None:
        """One part after the other."""
        from iibr_core.formats.images.exr_parts import COLORS, DISPARITY, ExrPart, write_exr_parts

        parts = [
            ExrPart(f"v{row:02d}_u{column:02d}", COLORS | (DISPARITY if (row, column) in self._has_disparity else {}))
            for row, column in self.places()
        ]
        write_exr_parts(self.path, self.size, parts, (self._picture(*at) for at in self.places()))

    def _picture(self, row: int, column: int) -> FloatImage:
        colors, disparity = self.view(row, column)
        light = linear_from_srgb(encoded_from_stored(colors))
        return light if disparity is None else np.dstack([light, disparity])
