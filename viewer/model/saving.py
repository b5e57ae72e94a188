"""Saves and exports: their prompts and default paths, the jobs under way, and quitting."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Literal, TypeVar

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.exports.kinds import DEFAULT_OPTIONS, EXPORTS, ExportKind, ExportOptions, Purpose, export_path
from iibr_core.formats.images.picture_kinds import AS_USUAL as USUAL_FORM
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.model.app_state import AppState
from viewer.model.demo_photo import is_ours
from viewer.model.messages import Notice, notify

Saved = Literal["picture", "map"]


@dataclass(frozen=True)
class SavePrompt:
    """The prompt to save the picture or its disparity map.

    already_there: whether the file exists. problem: reason why nothing can be saved there, "" without one.
    """

    path: str
    size_px: ScreenSize
    already_there: bool = False
    what: Saved = "picture"
    problem: str = ""
    form: PictureFormat = USUAL_FORM


@dataclass(frozen=True)
class ExportPrompt:
    """The prompt of an export.

    kind: name of its kind. already_there: whether the file exists. problem: reason why it cannot be exported.
    """

    kind: str
    path: str
    options: ExportOptions = DEFAULT_OPTIONS
    already_there: bool = False
    problem: str = ""


JobKind = Literal["picture", "map", "copy", "export"]
WAITING_FOR_VIEWS = "waiting for the views"
WRITING = "writing the file"
STOPPING = "stopping"


@dataclass(frozen=True)
class JobProgress:
    """A job that waits or runs.

    name: of its file or folder. doing: its present step, "" while it waits for its turn. done: share of this step,
    0..1. left_s: seconds that the step still takes, None if not known.
    """

    id: int
    kind: JobKind
    name: str
    doing: str = ""
    done: float = 0.0
    left_s: float | None = None

    @property
    def can_be_cancelled(self) -> bool:
        """Whether it has not come to writing its file."""
        return self.doing not in (WRITING, STOPPING)


@dataclass(frozen=True)
class FinishedFile:
    """A picture, map or export that was written or failed. prompt: asks for the same again. problem: why it failed."""

    path: str
    prompt: ExportPrompt | SavePrompt
    problem: str = ""


@dataclass(frozen=True)
class SavedSettings:
    """Settings with which a saved picture was taken.

    source: the decisions about it, without paths. size_px: (width, height). depth_edits: of the photo's disparity.
    unknown_fields: names of stored fields that this version does not know. has_model_depth: whether a model estimated
    the depth that the focus refers to. view_width: of the views, in whose pixels the optics are; None in older
    pictures. focused_at: place in focus, see `focal_plane`, None if none was clicked. depth_model: name or path of the
    model; only sessions know it.
    """

    optics: Optics
    depth_strength: float
    source: Source
    size_px: ScreenSize
    depth_edits: DepthEdits = UNEDITED
    unknown_fields: tuple[str, ...] = ()
    has_model_depth: bool = False
    view_width: int | None = None
    focused_at: tuple[float, float] | None = None
    depth_model: str = ""

    def optics_at(self, view_width: int) -> Optics:
        """Return the optics with the same focus among views of this width."""
        return self.optics.with_focus_scaled(view_width / (self.view_width or view_width))


MAX_FILES = 12
"""Number of saved and exported files in the list."""
Asked = ExportPrompt | SavePrompt
PlacePrompt = TypeVar("PlacePrompt", bound=SavePrompt | ExportPrompt)
NO_NAME = "There is no name yet. Type one, or press Browse…"


def ask_to_save(state: AppState, what: Saved = "picture") -> AppState:
    """Show the prompt to save the picture, at the photo's own size if that can be drawn, or the map of a photo."""
    scene = state.scene
    if scene is None or (what == "map" and scene.plan is None):
        return state
    is_full = state.optics.dolly == 0 and state.free_camera is None
    size = (scene.own_size if is_full else None) or scene.size
    path = _map_path(state, scene) if what == "map" else _place_of(state, f"{scene.name}-iibr.png")
    return replace(state, prompt=SavePrompt(path, size, what=what))


def ask_to_export(state: AppState) -> AppState:
    """Show the prompt of an export, with the kind and options of the last one."""
    if state.scene is None:
        return state
    last = state.last_export
    kind = first_kind("share") if last is None else last.kind
    path = usual_export_path(state, kind)
    return replace(state, prompt=ExportPrompt(kind, path) if last is None else ExportPrompt(kind, path, last.options))


def begin_job(state: AppState, path: Path, prompt: Asked | None = None) -> AppState:
    """Close the prompt of a save or export that begins, and remember its folder, kind and options.

    path: absolute.
    """
    preferences = replace(state.preferences, last_folder=str(path.parent))
    last = prompt if isinstance(prompt, ExportPrompt) else state.last_export
    shown = None if isinstance(state.prompt, SavePrompt | ExportPrompt) else state.prompt
    return replace(state, preferences=preferences, last_export=last, prompt=shown)


def finish_job(state: AppState, path: Path, message: str, prompt: Asked) -> AppState:
    """Notify that a file was written; it enters the list of files. message: more about the file, "" without."""
    verb = "Exported" if isinstance(prompt, ExportPrompt) else "Saved"
    notice = Notice(f"{verb} {path}. {message}" if message else f"{verb} {path}", is_result=True, path=str(path))
    return _with_finished(notify(state, notice), path, prompt)


def fail_job(state: AppState, path: Path, problem: str, prompt: Asked | None = None) -> AppState:
    """Notify that a file was not written, with the reason."""
    return _with_finished(notify(state, Notice(problem, is_error=True, is_result=True)), path, prompt, problem)


def set_jobs(state: AppState, jobs: tuple[JobProgress, ...]) -> AppState:
    """Replace the list of jobs; close the window if it waits for the last."""
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


def settings_of(state: AppState, size_px: ScreenSize) -> SavedSettings:
    """Return the settings that take the present picture again."""
    assert state.source is not None
    source = replace(state.source, path="", depth=replace(state.source.depth, file=None, refine=state.depth.refine))
    scene = state.scene
    return SavedSettings(
        state.optics,
        state.depth_strength,
        source,
        size_px,
        state.depth.edits,
        has_model_depth=scene is not None and scene.has_model_depth,
        view_width=scene.width if scene is not None else None,
        focused_at=state.focused_at,
    )


def kinds_for(purpose: Purpose) -> dict[str, ExportKind]:
    """Return the kinds of the table for a purpose, in its order."""
    return {name: kind for name, kind in EXPORTS.items() if kind.purpose == purpose}


def first_kind(purpose: Purpose) -> str:
    """Return the first kind for a purpose that needs no optional package."""
    return next(name for name, kind in kinds_for(purpose).items() if not kind.needs)


def usual_export_path(state: AppState, name: str) -> str:
    """Return the default path of an export of this kind."""
    assert state.scene is not None
    kind = EXPORTS[name]
    ending = kind.endings[0] if kind.endings else ""
    tag = "" if ending.startswith("_") else "-iibr" if ending == f".{name}" else f"-{name}"
    return _place_of(state, f"{state.scene.name}{tag}{ending}")


def as_other_kind(state: AppState, prompt: ExportPrompt, name: str) -> ExportPrompt:
    """Return the prompt for another kind: a typed name stays, with the ending of that kind."""
    before, kind = EXPORTS[prompt.kind], EXPORTS[name]
    path = PurePath(prompt.path.strip())
    if not path.name or prompt.path == usual_export_path(state, prompt.kind):
        return ExportPrompt(name, usual_export_path(state, name))
    ending = next((ending for ending in before.endings if path.name.lower().endswith(ending)), "")
    stem = path.name[: len(path.name) - len(ending)]
    return ExportPrompt(name, str(path.with_name(f"{stem}{kind.endings[0] if kind.endings else ''}")))


def picked_place(state: AppState) -> tuple[float, float] | None:
    """Return the place (x, y) that was selected, or else put in focus by a click, in pixels of the photo."""
    scene, place = state.scene, None
    if state.selection is not None:
        place = state.selection.place
    elif state.focused_at is not None:
        place = state.focused_at[0] / 2 + 0.5, state.focused_at[1] / 2 + 0.5
    if scene is None or place is None:
        return None
    size = scene.own_size or scene.size
    return place[0] * size.width, place[1] * size.height


def written_path(kind: ExportKind, typed: str, scene: Scene, options: ExportOptions) -> Path:
    """Return the path that is written for a typed path: with an ending if it has none, and with the tag that players
    read from the name. Raises InputError without a name, and as `export_path` does.
    """
    path = Path(typed.strip())
    if not path.name:
        raise InputError(NO_NAME)
    ending = next(iter(kind.endings), "")
    if not path.suffix and not path.name.endswith(PurePath(ending).stem):
        path = path.with_name(f"{path.name}{ending}")
    elif not path.suffix:
        path = path.with_suffix(PurePath(ending).suffix)
    return export_path(kind, path, scene, options)


def path_beside(path: str, name: str) -> str:
    """Return a path beside a photo; in the home folder for a pasted photo and for the demo."""
    folder = PurePath(path).parent
    return str((PurePath("~") if is_ours(path) else folder) / name)


def in_usual_folder(state: AppState, prompt: PlacePrompt) -> PlacePrompt:
    """Return a prompt whose path is absolute: a bare name belongs to the folder that the prompt began with."""
    typed = prompt.path.strip()
    if not typed or state.source is None:
        return prompt
    is_map = isinstance(prompt, SavePrompt) and prompt.what == "map"
    place = path_beside(state.source.path, typed) if is_map else _place_of(state, typed)
    return replace(prompt, path=os.path.abspath(os.path.expanduser(place)))


def _map_path(state: AppState, scene: Scene) -> str:
    """Return the default path of a map: where it is found when the photo is opened again, unless a map was given."""
    is_given = scene.depth_origin is not None and scene.depth_origin.kind == "file"
    return path_beside(scene.source.path, f"{scene.name}{'-edited.pfm' if is_given else '_disparity.pfm'}")


def _place_of(state: AppState, name: str) -> str:
    """Return a path in the folder that was used last, or beside the photo."""
    assert state.source is not None
    folder = state.preferences.last_folder
    return str(PurePath(folder) / name) if folder else path_beside(state.source.path, name)


def _with_finished(state: AppState, path: Path, prompt: Asked | None, problem: str = "") -> AppState:
    if prompt is None:
        return state
    return replace(state, files=(FinishedFile(str(path), prompt, problem), *state.files)[:MAX_FILES])
