"""Records of inspection; `viewer.model.inspection` has the verbs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from iibr_core.beyond.optics import Optics

OverlayKind = Literal["disparity", "entropy", "inpainted"]
OVERLAYS: tuple[OverlayKind, ...] = ("disparity", "entropy", "inpainted")
Comparison = Literal["photo", "snapshot"]
COMPARISONS: tuple[Comparison, ...] = ("photo", "snapshot")
ViewIndex = tuple[int, int]
"""(row, column) in a grid of views."""
Origin = Literal["photo", "generated", "inpainted", "from disk"]
"""Source of a pixel; "from disk": a light field that was read."""


@dataclass(frozen=True)
class Probe:
    """Values at one pixel of the picture. rgb: as drawn, sRGB bytes."""

    rgb: tuple[int, int, int]
    origin: Origin


@dataclass(frozen=True)
class Inspection:
    """Settings and findings of inspection.

    opacity: of the overlay, 0..1. divider: position of the line between compared images, 0..1 from the left;
    divider_taken: whether it is dragged. place: pixel (x, y) pointed at last. probe: values under the pointer.
    snapshot: state of the lens to compare with.
    """

    shows_epis: bool = False
    shows_views: bool = False
    shows_values: bool = False
    overlay: OverlayKind | None = None
    opacity: float = 0.75
    comparison: Comparison | None = None
    divider: float = 0.5
    divider_taken: bool = False
    place: tuple[float, float] | None = None
    probe: Probe | None = None
    snapshot: Optics | None = None

    @property
    def for_next_scene(self) -> Inspection:
        """The same settings without the findings of the present scene."""
        comparison: Comparison | None = "photo" if self.comparison == "photo" else None
        return replace(self, comparison=comparison, divider_taken=False, place=None, probe=None, snapshot=None)
