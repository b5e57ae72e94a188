"""What the state asks of the outside world. The loop has it done, and says what came of it by an action."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.formats.images.picture_kinds import AS_USUAL as USUAL_FORM
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.scenes.screen_size import ScreenSize
from viewer.model.state.depth_models import CancelGetTask, GetModelTask, ListModelsTask
from viewer.model.state.exporting import ExportPrompt, ExportTask
from viewer.model.state.folder import ListFolderTask
from viewer.model.state.jobs import CancelJobTask
from viewer.model.state.photo_facts import ReadFactsTask
from viewer.model.state.prompts import ChoiceOf, ListContentsTask, Saved, SavePrompt
from viewer.model.state.saving import CopyTask, PasteTask


@dataclass(frozen=True)
class ChooseTask:
    """Let the user choose, in the system's dialog where it has one."""

    what: ChoiceOf


@dataclass(frozen=True)
class ChoosePlaceTask:
    """Let the user choose where the file or folder goes that this prompt asks about."""

    prompt: SavePrompt | ExportPrompt


@dataclass(frozen=True)
class SaveTask:
    """Write the picture, or its disparity map. size_px: (width, height). form: how the picture is written."""

    path: str
    size_px: ScreenSize
    may_replace: bool = False
    what: Saved = "picture"
    form: PictureFormat = USUAL_FORM


@dataclass(frozen=True)
class ReadMaskTask:
    """Read an aperture mask."""

    path: str


Task = (
    ChooseTask
    | ChoosePlaceTask
    | SaveTask
    | CopyTask
    | PasteTask
    | ExportTask
    | CancelJobTask
    | ReadMaskTask
    | ListFolderTask
    | ListContentsTask
    | ReadFactsTask
    | ListModelsTask
    | GetModelTask
    | CancelGetTask
)
