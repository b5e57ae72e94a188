"""What the virtual camera does, viewpoint, focus, opening, light, and the actions that change it.

`viewer.model.reducers.lens` says what each action does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from iibr_core.rendering.gloss.settings import Gloss, GlossSurface
from iibr_core.types import ViewOffset

CENTRE = ViewOffset(0.0, 0.0)
EXPOSURE_LIMIT_STOPS = 6.0
RING_INNER_LIMIT = 0.95

LIMITS = "limits"
"""The key of a field's limits, where they are the same for every scene."""


def within(low: float, high: float, default: float) -> Any:
    """A number that is clamped to these limits."""
    return field(default=default, metadata={LIMITS: (low, high)})


PresetName = Literal["portrait", "macro", "everything sharp"]
ApertureKind = Literal["disc", "polygon", "ring", "cat_eye", "mask"]
APERTURE_KINDS: tuple[ApertureKind, ...] = ("disc", "polygon", "ring", "cat_eye", "mask")


@dataclass(frozen=True)
class ApertureMask:
    """A small grey image as aperture: rows x columns values of one byte each, row 0 on top, 255 = open."""

    name: str
    rows: int
    columns: int
    values: bytes


@dataclass(frozen=True)
class ApertureShape:
    """The opening, within a circle of the aperture's diameter.

    blades: corners of the polygon, 3 to 11. rotation_deg: turns polygon and mask clockwise. ring_inner: radius of the
    ring's blocked middle as a share of the opening's. cat_eye: 0..1, how much of the opening the lens barrel cuts off
    in the picture's corners. mask: None unless kind is "mask".
    """

    kind: ApertureKind = "disc"
    blades: int = 6
    rotation_deg: float = 0.0
    ring_inner: float = within(0.0, RING_INNER_LIMIT, 0.5)
    cat_eye: float = within(0.0, 1.0, 0.5)
    mask: ApertureMask | None = None


@dataclass(frozen=True)
class Optics:
    """What the virtual camera does.

    eye: viewpoint in view steps (t down, s right). dolly: how far forward, as the view steps by which the rays at the
    left and right border of the picture then cross the grid farther out. focus_disparity: the field disparity that is
    sharp in the middle of the picture (px per view step). focus_range: everything within this much disparity around it
    is sharp. focus_tilt: change of the sharp disparity from the picture's middle to its right and to its lower border.
    aperture_diameter: in view steps, 0 = pinhole. highlight_recovery: 0..1, how much brighter than white clipped
    pixels count. exposure_stops: brightness as a power of two. gloss: of a surface, None where all are as they are.
    """

    eye: ViewOffset = CENTRE
    dolly: float = 0.0
    focus_disparity: float = 0.0
    focus_range: float = 0.0
    focus_tilt: tuple[float, float] = (0.0, 0.0)
    aperture_diameter: float = 0.0
    aperture_shape: ApertureShape = ApertureShape()
    highlight_recovery: float = within(0.0, 1.0, 0.0)
    exposure_stops: float = within(-EXPOSURE_LIMIT_STOPS, EXPOSURE_LIMIT_STOPS, 0.0)
    gloss: Gloss | None = None


FIRST_GLOSS = Gloss(GlossSurface(farthest=0.5))
"""Of whoever tries what it is."""


@dataclass(frozen=True)
class GlossBrush:
    """What dragging over the picture marks as glossy, or takes out, while it is on. radius: see `GlossStroke`."""

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
class SetDolly:
    """Step forward (positive) or back; see `Optics.dolly`."""

    dolly: float


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
class SetFocusRange:
    """Everything within this much disparity around the focus is sharp."""

    disparity: float


@dataclass(frozen=True)
class SetTilt:
    """Tilt the plane of focus; see `Optics.focus_tilt`."""

    tilt: tuple[float, float]


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
class SetApertureShape:
    """Give the opening this shape."""

    shape: ApertureShape


@dataclass(frozen=True)
class SetHighlightRecovery:
    """Let clipped pixels count for more: 0..1."""

    amount: float


@dataclass(frozen=True)
class SetExposure:
    """Brighten the picture by this many stops."""

    stops: float


@dataclass(frozen=True)
class SetGloss:
    """Make a surface glossy, or leave all as they are."""

    gloss: Gloss | None


@dataclass(frozen=True)
class PaintGloss:
    """Begin a stroke that marks the glossy surface, or go on with the last one: (x, y) as shares of the photo's width
    and height.
    """

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
    MoveEye
    | SetDolly
    | SetFocus
    | FocusOn
    | SetFocusRange
    | SetTilt
    | MoveTiltHandle
    | SetAperture
    | SetApertureShape
    | SetHighlightRecovery
    | SetExposure
    | SetGloss
    | PaintGloss
    | ApplyPreset
    | ResetOptics
)
"""Edits of the optics alone."""
