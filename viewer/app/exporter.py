"""Exports of the window's scene: check a request and make it a job."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from iibr_core.exports.kinds import ExportKind, ExportOptions, export_kind, optics_of, require_export_place
from iibr_core.exports.source import ExportSource, write_export
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.runtime.extras import require_extra
from iibr_core.types import InputError
from viewer.app.job import Job
from viewer.app.job_queue import JobQueue
from viewer.model import messages, preferences
from viewer.model.action import Action, do
from viewer.model.remedies import words_of
from viewer.model.saving import written_path
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt, ExportTask
from viewer.model.state.notices import Notice


def add_export(task: ExportTask, state: AppState, inputs: Sequence[Path], jobs: JobQueue) -> list[Action]:
    """Queue an export of the present scene; show the prompt with the reason if it cannot be written.

    inputs: files that are read.
    """
    if state.scene is None:
        return []
    prompt = ExportPrompt(task.kind, task.path, task.options)
    try:
        kind = export_kind(task.kind)
        path = written_path(kind, os.path.expanduser(task.path.strip()), state.scene, task.options)
        require_export_place(kind, path, inputs, task.may_replace)
        if kind.needs:
            require_extra("export", *kind.needs)
        if jobs.writes(path):
            raise InputError(f"{path} is being written by another export: choose another name.")
    except AlreadyThereError:
        return [do(messages.show_prompt, replace(prompt, already_there=True))]
    except InputError as error:
        return [do(messages.show_prompt, replace(prompt, problem=words_of(error)))]
    work = partial(_export, kind, path, task.options)
    pictures = partial(optics_of, kind, task.options)
    jobs.add(Job("export", path, state, lambda scene, optics: "views", work, pictures))
    closed = [do(messages.show_prompt, None)] if isinstance(state.prompt, ExportPrompt) else []
    return [*closed, do(preferences.set_last_folder, os.path.abspath(path.parent))]


def _export(kind: ExportKind, path: Path, options: ExportOptions, source: ExportSource) -> list[Action]:
    message = write_export(kind, path, source, options)
    return [do(messages.notify, Notice(f"Exported {path}. {message}" if message else f"Exported {path}", stays=True))]
