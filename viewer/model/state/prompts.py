"""Questions to the user, one at a time, over everything else; saves and exports that follow from them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Literal

from iibr_core.exports.kinds import DEFAULT_OPTIONS, ExportOptions
from iibr_core.formats.images.picture_kinds import AS_USUAL as USUAL_FORM
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.scenes.screen_size import ScreenSize
from viewer.model.state.depth_models import ModelsPrompt

ChoiceOf = Literal["photo", "folder", "mask", "map", "model", "model folder"]
"""map: a disparity map for the open photo; model: an ONNX file of a depth model."""
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


@dataclass(frozen=True)
class Listing:
    """Folders and files to choose in a folder. typed: the folder as it was typed; path: the same, absolute."""

    typed: str
    path: str
    folders: tuple[str, ...] = ()
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class PathPrompt:
    """The prompt for the path of a file or folder, on systems without a file dialog.

    listing: of the folder of `path`, None until it is read. top: first row of the listing that is seen.
    """

    what: ChoiceOf
    path: str = ""
    problem: str = ""
    listing: Listing | None = None
    top: int = 0

    @property
    def folder(self) -> str:
        """The folder of the typed path, with a separator at its end; "" if none was typed."""
        return self.path[: max(map(self.path.rfind, (os.sep, "/"))) + 1]


@dataclass(frozen=True)
class PalettePrompt:
    """The list of commands, narrowed down by the typed text. selected: index of the one that Enter runs."""

    text: str = ""
    selected: int = 0


PlainPrompt = Literal["help", "about", "quit", "files"]
"""quit: whether to close although jobs are under way. files: the list of saved and exported files."""
Prompt = PathPrompt | SavePrompt | ExportPrompt | ModelsPrompt | PalettePrompt | PlainPrompt

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
