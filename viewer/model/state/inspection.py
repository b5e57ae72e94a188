"""What is looked at beside the picture: records of the state, and the actions that change them.

`viewer.model.reducers.inspection_reducer` says what each action does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from iibr_core.beyond.optics import Optics
from iibr_core.types import GridShape

OverlayKind = Literal["disparity", "entropy", "inpainted"]
OVERLAYS: tuple[OverlayKind, ...] = ("disparity", "entropy", "inpainted")
Comparison = Literal["photo", "truth", "kept", "difference"]
COMPARISONS: tuple[Comparison, ...] = ("photo", "truth", "kept", "difference")
ViewIndex = tuple[int, int]
"""(row, column) in a grid of views."""


@dataclass(frozen=True)
class GroundTruth:
    """A light field to compare with, on disk."""

    path: str
    name: str
    grid: GridShape
    width: int
    height: int


@dataclass(frozen=True)
class Pair:
    """Two images of one view, side by side. view: in the scene's grid, or the ground truth's ("truth").

    psnr_db (infinite where they are equal) and flip (mean, 0..1): of sRGB-encoded values; None until they are known,
    FLIP also where its package is not installed.
    """

    generation: int
    kind: Comparison
    view: ViewIndex
    psnr_db: float | None = None
    flip: float | None = None


Origin = Literal["photo", "generated", "inpainted", "from disk"]
"""Where a pixel comes from; "from disk": from a light field that was read."""


@dataclass(frozen=True)
class Probe:
    """What is known of the picture at one pixel.

    rgb: as drawn, sRGB bytes. seen_in: how many of the `of` views there show this surface, None where disparity is
    not known.
    """

    rgb: tuple[int, int, int]
    seen_in: int | None
    of: int
    origin: Origin


@dataclass(frozen=True)
class Inspection:
    """What is looked at beside the picture.

    opacity: of the overlay, 0..1. divider: where the picture is divided, 0..1 from its left; divider_taken: while it is
    dragged. pair: what is compared now (see `Pair`). place: pixel (x, y) pointed at last. probe: of the pixel under
    the pointer. kept: a state of the lens to compare with.
    """

    shows_epis: bool = False
    shows_grid: bool = False
    shows_values: bool = False
    overlay: OverlayKind | None = None
    opacity: float = 0.75
    comparison: Comparison | None = None
    divider: float = 0.5
    divider_taken: bool = False
    truth: GroundTruth | None = None
    pair: Pair | None = None
    place: tuple[float, float] | None = None
    probe: Probe | None = None
    kept: Optics | None = None


@dataclass(frozen=True)
class SetInspection:
    """Give one field of `Inspection` this value; the others have actions of their own, for more depends on them."""

    field: Literal["shows_epis", "shows_grid", "shows_values", "opacity", "probe"]
    value: bool | float | Probe | None


@dataclass(frozen=True)
class SetOverlay:
    """Lay this over the picture; None takes it away. It takes the place of a comparison."""

    kind: OverlayKind | None


@dataclass(frozen=True)
class Compare:
    """Divide the picture to compare; None: no longer. It takes the place of an overlay. A missing ground truth is asked
    for.
    """

    kind: Comparison | None


@dataclass(frozen=True)
class KeepState:
    """Remember the lens as it is, to compare with what it will be."""


@dataclass(frozen=True)
class MoveDivider:
    """Drag the divider to this place, 0..1 from the picture's left."""

    place: float


@dataclass(frozen=True)
class TruthRead:
    """A light field to compare with was found; it counts if it fits what is open."""

    truth: GroundTruth


@dataclass(frozen=True)
class PairCompared:
    """These two images are shown, or more is known of them."""

    pair: Pair


InspectionAction = SetInspection | SetOverlay | Compare | KeepState | MoveDivider | TruthRead | PairCompared
"""What is looked at beside the picture; the picture itself stays."""


def of_next_scene(inspection: Inspection) -> Inspection:
    """What stays when another scene is opened: what is looked at, not what was found."""
    comparison: Comparison | None = "photo" if inspection.comparison == "photo" else None
    stays = replace(inspection, comparison=comparison, divider_taken=False)
    return replace(stays, truth=None, pair=None, place=None, probe=None, kept=None)
