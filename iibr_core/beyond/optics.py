"""Settings of the virtual camera: viewpoint, focus, opening, light."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

from iibr_core.gloss.settings import Gloss
from iibr_core.types import CENTRE, ViewOffset

EXPOSURE_LIMIT_STOPS = 6.0
RING_INNER_LIMIT = 0.95
HIGHLIGHT_STOPS = 4.0
"""Stops by which full highlight recovery makes clipped pixels brighter than white."""
HIGHLIGHT_GAIN = 2**HIGHLIGHT_STOPS - 1
"""Light that it adds to them, where white is 1."""

LIMITS = "limits"
"""Key of a field's limits in its metadata, if they are the same for every scene."""


def within(low: float, high: float, default: float) -> Any:
    """Return a dataclass field for a number that is clamped to these limits."""
    return field(default=default, metadata={LIMITS: (low, high)})


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
    in the picture's corners. mask: None unless kind is "mask". roundness: 0..1, how far the polygon's sides are bent
    outward, from straight to the circle.
    """

    kind: ApertureKind = "disc"
    blades: int = 6
    rotation_deg: float = 0.0
    ring_inner: float = within(0.0, RING_INNER_LIMIT, 0.5)
    cat_eye: float = within(0.0, 1.0, 0.5)
    mask: ApertureMask | None = None
    roundness: float = within(0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Optics:
    """Settings of the virtual camera.

    eye: viewpoint in view steps (t down, s right). dolly: how far forward, as the view steps by which the rays at the
    left and right border of the picture then cross the grid farther out. focus_disparity: the field disparity that is
    sharp in the middle of the picture (px per view step). focus_range: everything within this much disparity around it
    is sharp. focus_tilt: change of the sharp disparity from the picture's middle to its right and to its lower border.
    aperture_diameter: in view steps, 0 = pinhole. highlight_recovery: 0..1, how much brighter than white clipped
    pixels count. exposure_stops: brightness as a power of two. gloss: added gloss of a surface, None without.
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

    def with_focus_scaled(self, ratio: float) -> Optics:
        """Return the same optics for disparities that are `ratio` times as large."""
        tilt_x, tilt_y = self.focus_tilt
        return replace(
            self,
            focus_disparity=self.focus_disparity * ratio,
            focus_range=self.focus_range * abs(ratio),
            focus_tilt=(tilt_x * ratio, tilt_y * ratio),
        )

    def highlight_gain(self, diameter: float, is_hdr: bool) -> float:
        """Return the light added to clipped pixels, where white is 1. diameter: the aperture's, in view steps."""
        return 0.0 if is_hdr else HIGHLIGHT_GAIN * self.highlight_recovery * min(diameter, 1.0)


PINHOLE = Optics()
"""The photo as it was taken."""
