"""Every layout of a light field on disk: who reads it, who writes it. The viewer, `generate` and `evaluate` ask here.

Entries are "module:name" in this folder, imported once they are used: the command line lists the writers without
loading what they need. A new layout is a file of its own and one line here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from pkgutil import resolve_name
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol, Self

from iibr_core.formats.files import is_folder, require_file
from iibr_core.formats.light_fields.whole_field import LENSLET_TAG
from iibr_core.formats.quilts import TAG as QUILT_TAG
from iibr_core.types import GridShape, InputError, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.formats.light_fields.multi_view_scene import MultiView

READERS = (
    "llff:read_llff",
    "stanford:read_stanford",
    "middlebury:read_middlebury",
    "hci:read_hci",
    "stanford_1996:read_stanford_1996",
    "numbered_grid:read_numbered_grid",
)
"""Of folders, in the order in which they are asked: `Reader`s."""

FILE_READERS = ("quilt:read_quilt", "lenslet_image:read_lenslet_image", "stereo_file:read_stereo_file")
"""Of files, in the order in which they are asked: `Reader`s. Two views are a photo, whose depth they tell."""

WRITERS = {
    "hci": "hci:HciWriter",
    "numbered-grid": "numbered_grid:NumberedGridWriter",
    "stanford": "stanford:StanfordWriter",
    "eslf": "whole_field:EslfWriter",
    "exr": "whole_field:ExrWriter",
}
"""By the name that people type: `WriterFactory`s."""

LAYOUTS = "HCI, Stanford archive, Heber, JPEG Pleno, LLFF, Middlebury, or views/v00_u00.png ..."
"""What the readers know, for people."""
FILES = "give a quilt (..._qs8x6a0.75.png), a lenslet image (..._eslf.png), a stereo photo, or a folder of views"


class LightFieldWriter(Protocol):
    """Writes a light field in a `with` block: it is there, whole, when the block ends well, else nothing is."""

    def __enter__(self) -> Self:
        """Raises InputError where nothing may be written."""

    def add(self, update: ViewUpdate) -> None:
        """Write one view, in any order. Raises InputError where an earlier one could not be written."""

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Raises InputError where views are missing or cannot be written."""


Reader = Callable[[Path], "MultiView | None"]
"""Gives the scene of a folder or file, None where it is laid out otherwise; InputError where it is damaged."""


class WriterFactory(Protocol):
    """Makes the writers of a layout: a class of them."""

    def __call__(
        self, folder: Path, grid: GridShape, focal_px: float, name: str, with_disparity: bool
    ) -> LightFieldWriter:
        """focal_px: of a view. name: of the scene. with_disparity: whether every view's disparity is wanted."""

    def require_place(self, folder: Path, inputs: Iterable[Path], may_replace: bool) -> None:
        """Raise InputError where no light field may be written; AlreadyThereError where one may not be replaced.

        inputs: files and folders that are read.
        """


def is_light_field(path: Path) -> bool:
    """Whether a path is to be opened as many views rather than as a photo: a folder, or a file that is named so."""
    return is_folder(path) or is_view_file(path)


def is_view_file(path: Path) -> bool:
    """Whether a file's name says that it holds many views."""
    return bool(QUILT_TAG.search(path.stem) or LENSLET_TAG.search(path.stem))


def find_light_field(path: Path) -> MultiView | None:
    """The scene of a folder or file, None where it is laid out as no reader knows. Raises InputError where it is
    damaged.
    """
    for entry in READERS if is_folder(path) else FILE_READERS:
        read: Reader = _resolve(entry)
        scene = read(path)
        if scene is not None:
            return scene
    return None


def open_light_field(path: Path) -> MultiView:
    """The scene of a folder or file. Raises InputError where there is none, or it is damaged."""
    if not is_folder(path):
        require_file(path)
    scene = find_light_field(path)
    if scene is None:
        if is_folder(path) and not any(path.iterdir()):
            raise InputError(f"{path}: no photos in it")
        said = f"laid out as {LAYOUTS}" if is_folder(path) else FILES
        raise InputError(f"{path}: holds no light field; {said}")
    return scene


def writer_for(layout: str) -> WriterFactory:
    """The writer of a layout, one of WRITERS. Raises InputError for others."""
    if layout not in WRITERS:
        raise InputError(f"{layout!r} is not a layout that can be written: give {' or '.join(WRITERS)}")
    factory: WriterFactory = _resolve(WRITERS[layout])
    return factory


def _resolve(entry: str) -> Any:
    return resolve_name(f"{__package__}.{entry}")
