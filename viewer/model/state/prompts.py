"""Questions to the user, one at a time, over everything else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.formats.images.picture_kinds import AS_USUAL as USUAL_FORM
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.scenes.screen_size import ScreenSize
from viewer.model.state.depth_models import ModelsPrompt
from viewer.model.state.exporting import ExportPrompt

ChoiceOf = Literal["photo", "folder", "mask", "map", "model", "model folder", "place"]
"""map: a disparity map for the open photo; model: an ONNX file of a depth model; place: where a file goes."""
FOLDER_CHOICES: tuple[ChoiceOf, ...] = ("folder", "model folder")
"""What is a folder."""


@dataclass(frozen=True)
class FolderContents:
    """Names of the folders in a folder, and of the files that can be chosen. is_read: whether they are known.
    problem: why they cannot be.
    """

    folder: str
    folders: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    is_read: bool = False
    problem: str = ""


@dataclass(frozen=True)
class ListContentsTask:
    """Look what of this kind can be chosen in this folder."""

    folder: str
    what: ChoiceOf


Saved = Literal["picture", "map"]


@dataclass(frozen=True)
class SavePrompt:
    """The question where to save the picture, and how large, or its disparity map. already_there: there is one.

    problem: why nothing can be saved there, "" before that is known. form: how the picture is written.
    """

    path: str
    size_px: ScreenSize
    already_there: bool = False
    what: Saved = "picture"
    problem: str = ""
    form: PictureFormat = USUAL_FORM


@dataclass(frozen=True)
class PathPrompt:
    """The question for a file or a folder, where the system has no file dialog. path: that is typed; with a separator
    at its end that of a folder. contents: of its folder, None before that is asked for. returns_to: what is asked again
    once a place is chosen.
    """

    what: ChoiceOf
    path: str = ""
    contents: FolderContents | None = None
    returns_to: SavePrompt | ExportPrompt | None = None


@dataclass(frozen=True)
class PalettePrompt:
    """The list of commands, narrowed down by what was typed. selected: which of those left Enter runs."""

    text: str = ""
    selected: int = 0


Prompt = PathPrompt | SavePrompt | ExportPrompt | ModelsPrompt | PalettePrompt | Literal["help", "quit"]
"""quit: whether to close although jobs are under way, or depth edits are saved nowhere."""
