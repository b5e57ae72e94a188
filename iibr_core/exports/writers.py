"""The kinds of export, carried out: where each goes, and what writes it, imported once it is used."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from iibr_core.exports.kinds import ExportKind, require_ending
from iibr_core.exports.settings import resolve_settings
from iibr_core.formats.light_fields.light_field_formats import writer_for
from iibr_core.formats.outputs import check_output, check_output_folder

if TYPE_CHECKING:
    from iibr_core.exports.options import ExportOptions
    from iibr_core.exports.source import ExportSource
    from iibr_core.rendering.optics import Optics
    from iibr_core.scenes.scene import Scene


def export_path(kind: ExportKind, path: Path, scene: Scene, options: ExportOptions) -> Path:
    """The name that is written. Raises InputError for options that mean nothing."""
    if not kind.path:
        return path
    named: Path = _resolve(kind.path)(path, scene, options)
    return named


def require_export_place(kind: ExportKind, path: Path, inputs: Sequence[Path], may_replace: bool) -> None:
    """Raise InputError where that may not be written, AlreadyThereError where something is. inputs: what is read."""
    require_ending(kind, path)
    if kind.layout:
        writer_for(kind.layout).require_place(path, inputs, may_replace)
    elif kind.endings:
        check_output(path, inputs, may_replace)
    else:
        check_output_folder(path, inputs, may_replace, kind.own_files)


def writer_of(kind: ExportKind) -> Callable[[Path, ExportSource, ExportOptions], str | None]:
    """What writes it; it may return a sentence about the file.

    It raises InputError where that cannot be, Cancelled once it should stop.
    """
    resolved: Callable[..., str | None] = _resolve(kind.write)
    writer = partial(resolved, kind.layout) if kind.layout else resolved

    def write(path: Path, source: ExportSource, options: ExportOptions) -> str | None:
        return writer(path, source, resolve_settings(kind, options, source.scene, source.optics))

    return write


def optics_of(kind: ExportKind, options: ExportOptions) -> Callable[[Scene, Optics], Sequence[Optics]]:
    """What finds, for the scene as the window shows it, what its pictures are drawn with; of a kind that is drawn.

    It raises InputError where they cannot be drawn.
    """

    def find(scene: Scene, optics: Optics) -> Sequence[Optics]:
        found: Sequence[Optics] = _resolve(kind.optics)(scene, optics, resolve_settings(kind, options, scene, optics))
        return found

    return find


def gallery_of(kind: ExportKind) -> Callable[[Path, Iterable[str]], Path] | None:
    """What writes the list of a batch's exports, by their names in its folder; None where there is none.

    It returns where that is, and raises InputError where it cannot be.
    """
    gallery: Callable[[Path, Iterable[str]], Path] | None = _resolve(kind.gallery) if kind.gallery else None
    return gallery


def _resolve(entry: str) -> Any:
    return resolve_name(f"{__package__}.{entry}")
