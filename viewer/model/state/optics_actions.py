"""What the virtual camera does, viewpoint, focus, opening, light, and the actions that change it.

`viewer.model.reducers.lens_reducer` says what each action does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.beyond.optics import ApertureShape
from iibr_core.gloss.settings import Gloss, GlossSurface
from iibr_core.types import ViewOffset

PresetName = Literal["portrait", "macro", "everything sharp"]


FIRST_GLOSS = Gloss(GlossSurface(farthest=0.5))
"""Gloss that the switch in the panel begins with: the nearer half of the scene."""


@dataclass(frozen=True)
class GlossBrush:
    """The brush that marks the glossy surface, or erases a part of it, while it is on. radius: see `GlossStroke`."""

    radius: float = 0.04
    erases: bool = False
    is_on: bool = False


@dataclass(frozen=True)
class SetGlossBrush:
    """Take this brush, or put it away."""

    brush: GlossBrush


@dataclass(frozen=True)
class MoveEye:
    """Put the viewpoint at this view offset (clamped to the grid and a margin beyond)."""

    eye: ViewOffset


@dataclass(frozen=True)
class SetOptics:
    """Give one field of `Optics` this value; fields that more depends on have actions of their own."""

    field: Literal[
        "dolly", "focus_range", "focus_tilt", "aperture_shape", "highlight_recovery", "exposure_stops", "gloss"
    ]
    value: float | tuple[float, float] | ApertureShape | Gloss | None


@dataclass(frozen=True)
class SetFocus:
    """Focus on this field disparity (px per view step), in the middle of the picture."""

    disparity: float


@dataclass(frozen=True)
class FocusOn:
    """What was clicked at this place (-1..1, see focal_plane) with this disparity becomes sharp."""

    place: tuple[float, float]
    disparity: float


@dataclass(frozen=True)
class MoveTiltHandle:
    """Drag a handle (0 or 1) to this place, over this disparity; None where nothing is known there."""

    index: int
    place: tuple[float, float]
    disparity: float | None


@dataclass(frozen=True)
class SetAperture:
    """Open the aperture to this diameter in view steps."""

    diameter: float


@dataclass(frozen=True)
class PaintGloss:
    """Begin a stroke of the gloss brush, or continue the last one. place: (x, y), shares of the photo's size."""

    place: tuple[float, float]
    brush: GlossBrush
    begins: bool


@dataclass(frozen=True)
class ApplyPreset:
    """Set focus and aperture for a purpose."""

    name: PresetName


@dataclass(frozen=True)
class ResetOptics:
    """Back to the centre viewpoint, the planned focus plane, a pinhole and the photo's exposure."""


LensAction = (
    MoveEye | SetOptics | SetFocus | FocusOn | MoveTiltHandle | SetAperture | PaintGloss | ApplyPreset | ResetOptics
)
"""Edits of the optics alone."""
