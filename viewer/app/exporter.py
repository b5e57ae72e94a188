"""Exports of the window's scene: what is asked for is looked at here, and becomes a job."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from iibr_core.exports.kinds import export_kind
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.exports.writers import optics_of, require_export_place, writer_of
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.rendering.optics import Optics
from iibr_core.runtime.extras import require_extra
from iibr_core.scenes.scene import Scene
from iibr_core.types import InputError
from viewer.app.job import Job
from viewer.app.job_queue import JobQueue
from viewer.model.actions import Action, Notify, ShowPrompt
from viewer.model.reducers.exporting_reducer import written_path
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt, ExportTask
from viewer.model.state.notices import Notice
from viewer.model.state.preferences import SetPreference

Write = Callable[[Path, ExportSource, ExportOptions], str | None]


def add_export(task: ExportTask, state: AppState, inputs: Sequence[Path], jobs: JobQueue) -> list[Action]:
    """Export the present scene, or say why not. inputs: what is read."""
    if state.scene is None:
        return []
    asked = ExportPrompt(task.kind, task.path, task.options)
    try:
        kind = export_kind(task.kind)
        path = written_path(kind, os.path.expanduser(task.path.strip()), state.scene, task.options)
        require_export_place(kind, path, inputs, task.may_replace)
        if kind.needs:
            require_extra("export", *kind.needs)
        if jobs.writes(path):
            raise InputError(f"{path} is being written by another export: choose another name.")
    except AlreadyThereError:
        return [ShowPrompt(replace(asked, already_there=True))]
    except InputError as error:
        return [ShowPrompt(replace(asked, problem=str(error)))]
    work = partial(_export, writer_of(kind), path, task.options)
    pictures = optics_of(kind, task.options) if kind.is_drawn else _no_pictures
    jobs.add(Job("export", path, state, lambda scene, optics: "views", work, pictures))
    closed = [ShowPrompt(None)] if isinstance(state.prompt, ExportPrompt) else []
    return [*closed, SetPreference("last_folder", os.path.abspath(path.parent))]


def _no_pictures(scene: Scene, optics: Optics) -> Sequence[Optics]:
    return ()


def _export(write: Write, path: Path, options: ExportOptions, source: ExportSource) -> list[Action]:
    said = write(path, source, options)
    return [Notify(Notice(f"Exported {path}. {said}" if said else f"Exported {path}", stays=True))]
