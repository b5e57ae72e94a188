"""Open light fields of every layout. The viewer, `generate` and `evaluate` ask here.

A new layout is a reader and one line here. Readers are imported on use, which keeps `--help` quick. Every
reader returns None for other layouts, and raises InputError with the file's name for damaged data.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING

from iibr_core.formats.files import require_file
from iibr_core.formats.light_fields.order import UNKNOWN, Arrangement
from iibr_core.formats.light_fields.write import LENSLET_TAG
from iibr_core.formats.quilts import TAG as QUILT_TAG
from iibr_core.types import InputError

if TYPE_CHECKING:
    from iibr_core.formats.light_fields.multi_view_scene import MultiView

FOLDER_READERS = (
    "camera_folders:read_llff", "data_sets:read_stanford", "data_sets:read_middlebury", "grids:read_grid",
    "camera_folders:read_posed", "pair_files:read_pair_folder",
)  # fmt: skip
"""Readers of folders, in the order in which they are asked."""
FILE_READERS = ("view_files:read_quilt", "view_files:read_lenslet_image", "view_files:read_stereo_file")
"""Readers of files, in the order in which they are asked."""

LAYOUTS = (
    "HCI, Stanford archive, JPEG Pleno, LLFF, nerfstudio, COLMAP, Middlebury, views/v00_u00.png ..., left.jpg and"
    " right.jpg; or state the grid of views under other names"
)
"""Layouts of folders, for people."""
FILES = "give a quilt (..._qs8x6a0.75.png), a lenslet image (..._eslf.png), a stereo photo, or a folder of views"


def is_light_field(path: Path) -> bool:
    """Return whether a path opens as many views, not as a photo: a folder, or a file as in `is_view_file`."""
    return path.is_dir() or is_view_file(path)


def is_view_file(path: Path) -> bool:
    """Return whether a file is named as a quilt or a lenslet image."""
    return bool(QUILT_TAG.search(path.stem) or LENSLET_TAG.search(path.stem))


def find_light_field(path: Path) -> MultiView | None:
    """Return the scene of a folder or file, None if no reader knows its layout, or its pictures may be any photos."""
    scene = _read(path)
    return None if scene is None or scene.is_guess else scene


def open_light_field(path: Path, given: Arrangement = UNKNOWN) -> MultiView:
    """Return the scene of a folder or file; numbered pictures that may be views count, too (`is_guess`).

    given: what the user states of their order; by a grid or an order, all pictures of a folder are views.
    """
    if not path.is_dir():
        require_file(path)
    is_stated = path.is_dir() and (given.grid or given.order) is not None
    scene = None
    with suppress(*((InputError,) if is_stated else ())):
        scene = _read(path)
    if scene is None and is_stated:
        from iibr_core.formats.light_fields.grids import read_in_grid

        scene = read_in_grid(path, given.grid) or _read(path)
    if scene is None:
        if path.is_dir() and not any(path.iterdir()):
            raise InputError(f"{path}: no photos in it")
        raise InputError(f"{path}: holds no light field; {f'laid out as {LAYOUTS}' if path.is_dir() else FILES}")
    return scene


def _read(path: Path) -> MultiView | None:
    for entry in FOLDER_READERS if path.is_dir() else FILE_READERS:
        read: Callable[[Path], MultiView | None] = resolve_name(f"{__package__}.{entry}")
        if (scene := read(path)) is not None:
            return scene
    return None
