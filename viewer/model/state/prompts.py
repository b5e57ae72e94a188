"""Questions to the user, one at a time, over everything else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.formats import AS_USUAL as USUAL_FORM
from iibr_core.formats import PictureFormat
from iibr_core.scenes import ScreenSize
from viewer.model.state.exporting import ExportPrompt
from viewer.model.state.model_download import ModelsPrompt

ChoiceOf = Literal["photo", "folder", "mask", "surroundings", "truth", "map", "model", "model folder"]
"""surroundings: what a glossy surface reflects; map: a disparity map for the photo that is open; model: an ONNX file
of depth."""


@dataclass(frozen=True)
class PathPrompt:
    """The question for a file, where the system has no file dialog."""

    what: ChoiceOf
    path: str = ""


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
class PalettePrompt:
    """The list of commands, narrowed down by what was typed. selected: which of those left Enter runs."""

    text: str = ""
    selected: int = 0


Prompt = PathPrompt | SavePrompt | ExportPrompt | ModelsPrompt | PalettePrompt | Literal["help", "quit"]
"""quit: whether to close although jobs are under way, or depth edits are saved nowhere."""
