"""Requests of the state to the outside world. `viewer.app.side_effects` carries them out and returns actions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from viewer.model.app_state import AppState
    from viewer.model.browsing import PathPrompt
    from viewer.model.saving import ExportPrompt, SavePrompt


ChoiceOf = Literal["photo", "folder", "mask", "map", "model", "model folder"]
"""map: a disparity map for the open photo; model: an ONNX file of a depth model."""

PlainKind = Literal[
    "copy", "paste", "find display", "read mask", "list folder", "read facts", "find recent", "list models",
    "download model", "stop download",
]  # fmt: skip


@dataclass(frozen=True)
class PlainTask:
    """A task without options. about: the path of a mask, folder or photo, or the name of a model, if it needs one.

    copy: put the picture, at the size of the views, into the system's clipboard. paste: open the picture that is there,
    or the path of one. find display: show the scene on the one that Looking Glass Bridge knows. read facts: those
    that a photo's file states. find recent: look which recent files exist. A stopped download is continued by the
    next one.
    """

    kind: PlainKind
    about: str = ""


@dataclass(frozen=True)
class ChooseTask:
    """Let the user choose a file or folder."""

    what: ChoiceOf


@dataclass(frozen=True)
class TakePathTask:
    """Use the path that was typed, if it exists."""

    prompt: PathPrompt


@dataclass(frozen=True)
class ListTask:
    """List the folder of the path that was typed so far."""

    prompt: PathPrompt


@dataclass(frozen=True)
class ChoosePlaceTask:
    """Let the user choose, in a dialog, the place that a prompt asks for."""

    prompt: SavePrompt | ExportPrompt


@dataclass(frozen=True)
class SaveTask:
    """Save the picture or its disparity map, or export the scene, as the prompt asks for."""

    prompt: SavePrompt | ExportPrompt
    may_replace: bool = False


@dataclass(frozen=True)
class CancelJobTask:
    """Cancel the job of this id; the others continue."""

    id: int


@dataclass(frozen=True)
class ShowFileTask:
    """Open a file in the system's program for it, or show it in its folder."""

    path: str
    in_folder: bool = False


@dataclass(frozen=True)
class FocusTask:
    """Focus on the surface that is seen now at a place, (x, y) from -1 to 1 across the picture, y down."""

    place: tuple[float, float]


Task = (
    PlainTask | ChooseTask | TakePathTask | ListTask | ChoosePlaceTask | SaveTask | CancelJobTask
    | ShowFileTask | FocusTask
)  # fmt: skip


def ask(state: AppState, task: Task) -> AppState:
    """Ask the outside world to carry out a task; the loop takes it up in its next turn."""
    return state.with_tasks(task)


def forget_tasks(state: AppState, count: int) -> AppState:
    """Forget the first tasks, which were taken up."""
    return replace(state, tasks=state.tasks[count:])
