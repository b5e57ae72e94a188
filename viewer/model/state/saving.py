"""Pictures to files and to the clipboard and back: where they go, what a file keeps, and the tasks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize

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
class SavedSettings:
    """What a saved picture was taken with. source: what was decided, without paths. size_px: (width, height).

    depth_edits: of the photo's disparity. unknown_fields: names of what was saved too, but is not known here.
    has_model_depth: whether a model estimated the depth that the focus is of. view_width: of the views, in whose pixels
    the optics are; None in older pictures.
    """

    optics: Optics
    depth_strength: float
    source: Source
    size_px: ScreenSize
    depth_edits: DepthEdits = UNEDITED
    unknown_fields: tuple[str, ...] = ()
    has_model_depth: bool = False
    view_width: int | None = None

    def optics_at(self, view_width: int) -> Optics:
        """The same focus among views of this width, as wide as those it was set in where that is not known."""
        return self.optics.with_focus_scaled(view_width / (self.view_width or view_width))


@dataclass(frozen=True)
class CopyTask:
    """Put the picture, at the size of the views, into the system's clipboard."""


@dataclass(frozen=True)
class PasteTask:
    """Open what the system's clipboard holds: a picture, or the path of one."""
