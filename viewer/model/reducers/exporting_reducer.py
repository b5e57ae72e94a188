"""Exports and saves: what is asked for, and where it goes unless the user says otherwise."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path, PurePath

from iibr_core.exports.kinds import EXPORTS, ExportKind, Purpose
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.writers import export_path
from iibr_core.scenes.scene import Scene
from iibr_core.types import InputError
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import ExportPrompt
from viewer.model.state.prompts import Saved, SavePrompt
from viewer.model.state.saving import path_beside


def kinds_for(purpose: Purpose) -> dict[str, ExportKind]:
    """Those of the registry, in its order."""
    return {name: kind for name, kind in EXPORTS.items() if kind.purpose == purpose}


def first_kind(purpose: Purpose) -> str:
    """What is offered first: it needs nothing that may not be installed."""
    return next(name for name, kind in kinds_for(purpose).items() if not kind.needs)


def ask_to_export(state: AppState) -> AppState:
    """With the question; as it is where nothing is open."""
    if state.scene is None:
        return state
    kind = first_kind("share")
    return replace(state, prompt=ExportPrompt(kind, usual_export_path(state, kind)))


def usual_export_path(state: AppState, name: str) -> str:
    """Where this kind goes unless the user says otherwise."""
    assert state.scene is not None
    kind = EXPORTS[name]
    ending = kind.endings[0] if kind.endings else ""
    is_plain = ending == f".{name}"  # the ending says which kind it is
    return _place_of(state, f"{state.scene.name}-{'iibr' if is_plain else name}{ending}")


def as_other_kind(state: AppState, prompt: ExportPrompt, name: str) -> ExportPrompt:
    """The question for another kind: a name that was typed stays, with that kind's ending."""
    before, kind = EXPORTS[prompt.kind], EXPORTS[name]
    path = PurePath(prompt.path.strip())
    if not path.name or prompt.path == usual_export_path(state, prompt.kind):
        return ExportPrompt(name, usual_export_path(state, name))
    ending = next((each for each in before.endings if path.name.lower().endswith(each)), "")
    stem = path.name[: len(path.name) - len(ending)]
    return ExportPrompt(name, str(path.with_name(f"{stem}{kind.endings[0] if kind.endings else ''}")))


def written_path(kind: ExportKind, typed: str, scene: Scene, options: ExportOptions) -> Path:
    """The file or folder that becomes of what was typed: as it is, with an ending where it has none, and with what
    players read from the name where the format says it nowhere else. Raises InputError without a name, and as
    `export_path` does.
    """
    path = Path(typed.strip())
    if not path.name:
        raise InputError("There is no name yet: type one, or press Browse…")
    if kind.endings and not path.suffix:
        path = path.with_name(f"{path.name}{kind.endings[0]}")
    return export_path(kind, path, scene, options)


def _place_of(state: AppState, name: str) -> str:
    """In the folder that was used last; beside the photo before."""
    assert state.source is not None
    folder = state.preferences.last_folder
    return str(PurePath(folder) / name) if folder else path_beside(state.source.path, name)


def ask_to_save(state: AppState, what: Saved) -> AppState:
    """Ask where to save the picture, at the photo's own size where it can be drawn so, or the map of a photo."""
    scene = state.scene
    if scene is None or (what == "map" and scene.plan is None):
        return state
    is_full = state.optics.dolly == 0 and state.free_camera is None
    size = (scene.own_size if is_full else None) or scene.size
    return replace(state, prompt=SavePrompt(_usual_path(state, what), size, what=what))


def _usual_path(state: AppState, what: Saved) -> str:
    """Where it is saved unless the user says otherwise. A map goes beside the photo: it is found there the next time,
    unless one was given for it.
    """
    assert state.source is not None
    assert state.scene is not None
    if what == "picture":
        return _place_of(state, f"{state.scene.name}-iibr.png")
    origin = state.scene.depth_origin
    is_given = origin is not None and origin.kind == "file"
    ending = "-edited.pfm" if is_given else "_disparity.pfm"
    return path_beside(state.source.path, f"{state.scene.name}{ending}")
