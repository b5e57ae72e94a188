"""What the user does to the depth that was found: records of the state, and the actions that change them.

`viewer.model.reducers.depth_editing_reducer` says what each action does.
"""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.depth.editing.edits import BrushTool, DepthEdits


@dataclass(frozen=True)
class DepthSample:
    """A place whose depth was picked, (x, y) as shares of the photo's width and height; the disparity seen there."""

    place: tuple[float, float]
    disparity: float


@dataclass(frozen=True)
class Brush:
    """What dragging over the picture does while it is on. radius, strength: see `Stroke`.

    sample: where the depth is taken from that "level" and "fill" lead to, None: where the stroke begins.
    """

    tool: BrushTool = "nearer"
    radius: float = 0.03
    strength: float = 0.25
    is_on: bool = False
    sample: DepthSample | None = None


@dataclass(frozen=True)
class SetRefine:
    """Draw the edges of disparity to the photo's, or leave them."""

    is_on: bool


@dataclass(frozen=True)
class SetTone:
    """Invert, clip and bend the disparity as these edits say; their strokes do not count. While the edit is not
    finished only the preview shows it.
    """

    tone: DepthEdits
    is_finished: bool


@dataclass(frozen=True)
class SetBrush:
    """Take this brush, or put it away."""

    brush: Brush


@dataclass(frozen=True)
class Paint:
    """Begin a stroke here, or go on with it: (x, y) as shares of the photo's width and height."""

    place: tuple[float, float]


@dataclass(frozen=True)
class PickDepth:
    """Have the brush lead to the depth of this place."""

    sample: DepthSample


@dataclass(frozen=True)
class DropStroke:
    """Take the stroke under way back."""


@dataclass(frozen=True)
class ResetDepth:
    """Depth as it was found and opened."""


DepthAction = SetRefine | SetTone | SetBrush | Paint | PickDepth | DropStroke | ResetDepth
