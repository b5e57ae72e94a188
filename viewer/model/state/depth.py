"""Records of depth editing; `viewer.model.depth` has the verbs."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.depth.editing.edits import BrushTool


@dataclass(frozen=True)
class DepthSample:
    """A place whose depth was picked, (x, y) as shares of the photo's width and height, and the disparity there."""

    place: tuple[float, float]
    disparity: float


@dataclass(frozen=True)
class Brush:
    """The tool that paints while the pointer drags over the picture. radius, strength: see `Stroke`.

    sample: source of the depth that "level" and "fill" paint, None: the beginning of the stroke.
    """

    tool: BrushTool = "nearer"
    radius: float = 0.03
    strength: float = 0.25
    is_on: bool = False
    sample: DepthSample | None = None
