"""Settings that a saved picture keeps."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize


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
