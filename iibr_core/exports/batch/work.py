"""What a worker process does: one photo, opened, exported, on disk to stay."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from iibr_core.exports.batch.task import Outcome, PhotoTask

if TYPE_CHECKING:
    from iibr_core.exports.export_opening import OpenDrawn
    from iibr_core.scenes.scene import Scene


def export_photo(task: PhotoTask, open_drawn: OpenDrawn | None) -> Outcome:
    """Write a photo's export. What is wrong with the photo is an answer too: only a worker's end is none.

    open_drawn: opens what is to be drawn, None where nothing is.
    """
    from iibr_core.formats.files import reason_of
    from iibr_core.types import InputError

    started = time.perf_counter()
    try:
        output, is_guess = _export(task, open_drawn)
        _flush_to_disk(output)
    except InputError as error:
        return Outcome(reason=str(error))
    except MemoryError as error:
        return Outcome(reason=f"out of memory ({reason_of(error)}): lower --max-pixels, or --workers")
    except Exception as error:
        return Outcome(reason=f"unexpected {type(error).__name__}: {reason_of(error)} (please report it)")
    return Outcome(str(output), seconds=time.perf_counter() - started, is_guess=is_guess)


def _export(task: PhotoTask, open_drawn: OpenDrawn | None) -> tuple[Path, bool]:
    """What was written, and whether its depth was guessed. Raises InputError."""
    from iibr_core.exports.export_opening import open_for_export
    from iibr_core.exports.writers import export_path, require_export_place, writer_of
    from iibr_core.formats.outputs import AlreadyThereError, make_folder, release_place
    from iibr_core.formats.places import require_no_link
    from iibr_core.scenes.inputs import inputs_of
    from iibr_core.scenes.lens_limits import LensChoice

    kind, options, place = task.settings.export_kind, task.settings.options, task.place
    target = place.target

    def require_place(scene: Scene) -> None:
        nonlocal target
        target = export_path(kind, place.target, scene, options)
        require_no_link(target, Path(place.folder))
        make_folder(target.parent)
        require_export_place(kind, target, inputs_of(task.source), place.may_write(target))
        _claim(task, target)

    settings = task.settings
    lens = LensChoice(None, settings.focus, settings.aperture, settings.gloss)
    opened = open_for_export(kind, options, task.source, settings.depth_strength, lens, require_place, open_drawn)
    try:
        writer_of(kind)(target, opened, options)
    except AlreadyThereError:  # somebody put it there meanwhile
        place.claim.unlink(missing_ok=True)
        raise
    finally:
        release_place(target)
    if not place.claim.exists():  # whoever waited for this photo has gone
        _claim(task, target)
    return target, opened.scene.is_guessed


def _claim(task: PhotoTask, output: Path) -> None:
    from iibr_core.formats.outputs import write_file

    with write_file(task.place.claim) as temporary:
        temporary.write_bytes(task.line(str(output), key=task.key))
        _sync(temporary)
    _sync(task.place.claim.parent)


def _flush_to_disk(output: Path) -> None:
    """Whatever happens to the power now, what was written stays, under its name."""
    inside = [Path(place, name) for place, _, names in os.walk(output) for name in names]
    for path in (*inside, output, output.parent):
        _sync(path)


def _sync(path: Path) -> None:
    with suppress(OSError):  # a system that syncs no folders
        # Windows syncs only what may be written; elsewhere no folder may be.
        descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
