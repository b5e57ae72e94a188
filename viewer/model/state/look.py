"""Record of a look; `viewer.model.look` has the verbs."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.scenes.scene import Source


@dataclass(frozen=True)
class Look:
    """A look that was copied. aperture_share: of the widest aperture; range_share: of all depth, for the sharp range.

    tone: clips, gamma and inversion of the depth, without strokes. wanted_for: photo that is being opened to have it.
    """

    optics: Optics
    aperture_share: float
    range_share: float
    tone: DepthEdits
    depth_strength: float
    wanted_for: Source | None = None
