"""Saves and exports: their prompts and default paths, the jobs under way, and quitting."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path, PurePath

from iibr_core.exports.kinds import EXPORTS, ExportKind, ExportOptions, Purpose, export_path
from iibr_core.scenes.scene import Scene
from iibr_core.types import InputError
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt
from viewer.model.state.jobs import JobProgress
from viewer.model.state.prompts import Saved, SavePrompt
from viewer.model.state.saving import path_beside


def kinds_for(purpose: Purpose) -> dict[str, ExportKind]:
    """Return the kinds of the table for a purpose, in its order."""
    return {name: kind for name, kind in EXPORTS.items() if kind.purpose == purpose}


def first_kind(purpose: Purpose) -> str:
    """Return the first kind for a purpose that needs no optional package."""
    return next(name for name, kind in kinds_for(purpose).items() if not kind.needs)


def ask_to_export(state: AppState) -> AppState:
    """Show the prompt of an export if a scene is open."""
    if state.scene is None:
        return state
    kind = first_kind("share")
    return replace(state, prompt=ExportPrompt(kind, usual_export_path(state, kind)))


def usual_export_path(state: AppState, name: str) -> str:
    """Return the default path of an export of this kind."""
    assert state.scene is not None
    kind = EXPORTS[name]
    ending = kind.endings[0] if kind.endings else ""
    return _place_of(state, f"{state.scene.name}-{'iibr' if name in ending else name}{ending}")


def as_other_kind(state: AppState, prompt: ExportPrompt, name: str) -> ExportPrompt:
    """Return the prompt for another kind: a typed name stays, with the ending of that kind."""
    before, kind = EXPORTS[prompt.kind], EXPORTS[name]
    path = PurePath(prompt.path.strip())
    if not path.name or prompt.path == usual_export_path(state, prompt.kind):
        return ExportPrompt(name, usual_export_path(state, name))
    ending = next((ending for ending in before.endings if path.name.lower().endswith(ending)), "")
    stem = path.name[: len(path.name) - len(ending)]
    return ExportPrompt(name, str(path.with_name(f"{stem}{kind.endings[0] if kind.endings else ''}")))


def written_path(kind: ExportKind, typed: str, scene: Scene, options: ExportOptions) -> Path:
    """Return the path that is written for a typed path: with an ending if it has none, and with the tag that players
    read from the name. Raises InputError without a name, and as `export_path` does.
    """
    path = Path(typed.strip())
    if not path.name:
        raise InputError("There is no name yet: type one, or press Browse…")
    if kind.endings and not path.suffix:
        tag = kind.endings[0].partition(".")[0]
        path = path.with_name(f"{path.name.removesuffix(tag)}{kind.endings[0]}")
    return export_path(kind, path, scene, options)


def _place_of(state: AppState, name: str) -> str:
    """Return a path in the folder that was used last, or beside the photo."""
    assert state.source is not None
    folder = state.preferences.last_folder
    return str(PurePath(folder) / name) if folder else path_beside(state.source.path, name)


def ask_to_save(state: AppState, what: Saved = "picture") -> AppState:
    """Show the prompt to save the picture, at the photo's own size if that can be drawn, or the map of a photo."""
    scene = state.scene
    if scene is None or (what == "map" and scene.plan is None):
        return state
    is_full = state.optics.dolly == 0 and state.free_camera is None
    size = (scene.own_size if is_full else None) or scene.size
    return replace(state, prompt=SavePrompt(_usual_path(state, what), size, what=what))


def _usual_path(state: AppState, what: Saved) -> str:
    """Return the default path. A map goes beside the photo, where it is found when the photo is opened again, unless
    the user gave a map.
    """
    assert state.source is not None
    assert state.scene is not None
    if what == "picture":
        return _place_of(state, f"{state.scene.name}-iibr.png")
    origin = state.scene.depth_origin
    is_given = origin is not None and origin.kind == "file"
    ending = "-edited.pfm" if is_given else "_disparity.pfm"
    return path_beside(state.source.path, f"{state.scene.name}{ending}")


def set_jobs(state: AppState, jobs: tuple[JobProgress, ...]) -> AppState:
    """Take over the list of jobs; close the window where it waited for the last."""
    state = replace(state, jobs=jobs)
    return quit_window(state) if state.quits_when_done and not jobs else state


def quit_window(state: AppState, is_sure: bool = False) -> AppState:
    """Close the window; ask first while jobs are under way."""
    asks = bool(state.jobs) and not is_sure
    state = replace(state, quits_when_done=False)
    return replace(state, prompt="quit") if asks else replace(state, should_quit=True)


def quit_when_done(state: AppState) -> AppState:
    """Close the window after the last job; a job that fails keeps it open."""
    state = replace(state, quits_when_done=True, prompt=None)
    return state if state.jobs else quit_window(state)
