"""What a worker process does: one photo, opened, exported, on disk to stay."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from viewer.app.batch.task import BatchSettings, Outcome, PhotoTask

if TYPE_CHECKING:
    from viewer.app.exports.source import ExportSource
    from viewer.app.headless import HeadlessViewer
    from viewer.model.actions import Action
    from viewer.model.state.scene import Scene

WARM_SIZE = 120, 160
_own = threading.local()
"""Of a thread: its viewer, kept from photo to photo. GL contexts belong to threads."""


def export_photo(task: PhotoTask) -> Outcome:
    """Write a photo's export. What is wrong with the photo is an answer too: only a worker's end is none."""
    from iibr_core.formats.files import reason_of
    from iibr_core.types import InputError

    started = time.perf_counter()
    try:
        output = _export(task)
        _settle_on_disk(output)
    except InputError as error:
        return Outcome(reason=str(error))
    except MemoryError as error:
        return Outcome(reason=f"out of memory ({reason_of(error)}): lower --max-pixels, or --workers")
    except Exception as error:
        return Outcome(reason=f"unexpected {type(error).__name__}: {reason_of(error)} (please report it)")
    return Outcome(str(output), seconds=time.perf_counter() - started)


def warm_up(settings: BatchSettings, memory_bytes: int | None = None) -> None:
    """Have all kernels compiled, models loaded and shaders built that these settings need, by a photo of no worth."""
    import numpy as np

    from iibr_core.formats.images.photo import write_image
    from iibr_core.formats.maps.writer import write_map

    rows, columns = np.indices(WARM_SIZE)
    is_near = (abs(rows - 60) < 30) & (abs(columns - 80) < 40)
    texture = np.random.default_rng(0).integers(0, 60, (*WARM_SIZE, 3))
    with tempfile.TemporaryDirectory() as folder:
        photo = Path(folder, "photo.png")
        write_image(photo, (texture + np.where(is_near, 150, 40)[..., None]).astype(np.uint8))
        if settings.source.depth.start == "auto":
            write_map(Path(folder, "photo_disparity.pfm"), np.where(is_near, 2.0, 0.5).astype(np.float32))
        ending = (settings.export_kind.endings or ("",))[0]
        export_photo(PhotoTask(str(photo), str(Path(folder, "made", f"made{ending}")), "", settings, memory_bytes))


def _export(task: PhotoTask) -> Path:
    """Raises InputError."""
    from iibr_core.formats.outputs import make_folder
    from viewer.app.exports.registry import export_path, require_export_place, writer_of
    from viewer.app.save_places import inputs_of

    kind, options, target = task.settings.export_kind, task.settings.options, Path(task.target)

    def require_place(scene: Scene) -> None:
        nonlocal target
        target = export_path(kind, Path(task.target), scene, options)
        make_folder(target.parent)
        require_export_place(kind, target, inputs_of(task.source), may_replace=True)

    opened = _open(task, require_place)
    writer_of(kind)(target, opened, options)
    return target


def _open(task: PhotoTask, require_place: Callable[[Scene], None]) -> ExportSource:
    from viewer.app.exports.opening import open_drawn, open_undrawn
    from viewer.model.state.optics import SetAperture, SetFocus, SetGloss

    settings = task.settings
    if not settings.export_kind.is_drawn:
        needs_disparity = not settings.export_kind.layout
        return open_undrawn(task.source, settings.depth_strength, needs_disparity, require_place, gloss=settings.gloss)
    lens: list[Action] = [] if settings.focus is None else [SetFocus(settings.focus)]
    lens += [] if settings.aperture is None else [SetAperture(settings.aperture)]
    lens += [SetGloss(settings.gloss)]
    return open_drawn(_viewer(), task.source, settings.depth_strength, lens, require_place)


def _viewer() -> HeadlessViewer:
    """The thread's own."""
    from viewer.app.headless import HeadlessViewer

    if not hasattr(_own, "viewer"):
        _own.viewer = HeadlessViewer()
    viewer: HeadlessViewer = _own.viewer
    return viewer


def _settle_on_disk(output: Path) -> None:
    """Whatever happens to the power now, what was written stays, under its name."""
    inside = [Path(place, name) for place, _, names in os.walk(output) for name in names]
    for path in (*inside, output, output.parent):
        with suppress(OSError):  # a system that syncs no folders
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
