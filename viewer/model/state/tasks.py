"""Requests of the state to the outside world. `viewer.app.side_effects` carries them out and returns actions."""

from __future__ import annotations

from dataclasses import dataclass

from viewer.model.state.depth_models import CancelGetTask, GetModelTask, ListModelsTask
from viewer.model.state.folder import ListFolderTask
from viewer.model.state.prompts import ChoiceOf, ExportPrompt, PathPrompt, SavePrompt


@dataclass(frozen=True)
class ChooseTask:
    """Let the user choose a file or folder."""

    what: ChoiceOf


@dataclass(frozen=True)
class TakePathTask:
    """Use the path that was typed, if it exists."""

    prompt: PathPrompt


@dataclass(frozen=True)
class ChoosePlaceTask:
    """Let the user choose, in a dialog, the place that a prompt asks for."""

    prompt: SavePrompt | ExportPrompt


@dataclass(frozen=True)
class SaveTask:
    """Save the picture or its disparity map."""

    prompt: SavePrompt
    may_replace: bool = False


@dataclass(frozen=True)
class ExportTask:
    """Export the scene."""

    prompt: ExportPrompt
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
class CopyTask:
    """Put the picture, at the size of the views, into the system's clipboard."""


@dataclass(frozen=True)
class PasteTask:
    """Open the picture that is in the system's clipboard, or the path of one."""


@dataclass(frozen=True)
class ReadFactsTask:
    """Read the facts that this photo's file states."""

    path: str


@dataclass(frozen=True)
class ReadMaskTask:
    """Read an aperture mask."""

    path: str


Task = (
    ChooseTask
    | TakePathTask
    | ChoosePlaceTask
    | SaveTask
    | ExportTask
    | CancelJobTask
    | ShowFileTask
    | CopyTask
    | PasteTask
    | ReadMaskTask
    | ListFolderTask
    | ReadFactsTask
    | ListModelsTask
    | GetModelTask
    | CancelGetTask
)
