"""A picture on its way to a file: what the panel says of it, the action that changes that, and what the file keeps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath

from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.runtime.resources import resource_folder
from viewer.model.layout import ScreenSize
from viewer.model.state.optics import Optics
from viewer.model.state.scene import Source

PASTED_FOLDER = "pasted"
"""Where pasted pictures lie for a while: nothing else is to be put there."""


def path_beside(path: str, name: str) -> str:
    """Where a file of this name is saved that is made of the photo at path: beside it; at home, of a pasted one and of
    the demo, whose folder is the program's.
    """
    folder = PurePath(path).parent
    is_ours = folder.name == PASTED_FOLDER or folder.is_relative_to(resource_folder("assets"))
    return str((PurePath("~") if is_ours else folder) / name)


@dataclass(frozen=True)
class Saving:
    """The picture that is being saved. name: of its file. drawn: share that is drawn, 0..1; at 1 it is being written.

    waiting: how many more wait for it. seconds_left: about, None where that is not known.
    """

    name: str
    drawn: float = 0.0
    waiting: int = 0
    seconds_left: int | None = None


@dataclass(frozen=True)
class SavingChanged:
    """Another picture is being saved, or it has come further; None: nothing is any more."""

    saving: Saving | None


@dataclass(frozen=True)
class SavedSettings:
    """What a saved picture was taken with. source: what was decided, without paths. size_px: (width, height).

    depth_edits: of the photo's disparity. unknown_fields: names of what was saved too, but is not known here.
    """

    optics: Optics
    depth_strength: float
    source: Source
    size_px: ScreenSize
    depth_edits: DepthEdits = UNEDITED
    unknown_fields: tuple[str, ...] = ()


@dataclass(frozen=True)
class CopyTask:
    """Put the picture, at the size of the views, into the system's clipboard."""


@dataclass(frozen=True)
class PasteTask:
    """Open what the system's clipboard holds: a picture, or the path of one."""


@dataclass(frozen=True)
class WriteSidecarTask:
    """Keep what the photo is left with beside it too, for other machines."""


@dataclass(frozen=True)
class CancelSaveTask:
    """Give up the picture that is being drawn for a file; the next one follows."""
