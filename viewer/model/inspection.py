"""Inspection of a light field: verbs, and the views and rectangles that follow from the state."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape, ViewOffset
from viewer.model.action import Setter, setter
from viewer.model.layout import Beside
from viewer.model.messages import Notice, notify

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


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


@dataclass(frozen=True)
class Hover:
    """Pointer in the picture: its place in pixels, and the disparity there, None if it is not known."""

    x_px: float
    y_px: float
    disparity: float | None


DIVIDER_MARGIN = 0.02
"""Smallest distance of the divider from the picture's borders, as a share of its width."""
SHEET_GAP = 3.0
"""Gap between the views of the sheet, in window units at usual size."""
NO_INPAINTING = "A light field from disk has no inpainted views."
NO_DEPTH = "These views have no depth."
NO_SNAPSHOT = "There is no snapshot yet. Take one first (K)."
SNAPSHOT_TAKEN = "Snapshot taken. Change the picture, then compare."
COMPARE_SNAPSHOT = "Compare with the snapshot"
"""Name of the command that is offered after a snapshot."""


@dataclass(frozen=True)
class InspectionTextures:
    """GL names of the textures that inspection shows, None without; rows top-down.

    shown: records of their contents; two records differ where the images differ.
    """

    strip_across: int | None = None
    strip_down: int | None = None
    sheet: int | None = None
    overlay: int | None = None
    compared: int | None = None
    minimap: int | None = None
    shown: tuple[object, ...] = ()


NO_INSPECTION_TEXTURES = InspectionTextures()
show_epis: Setter[bool] = setter("inspection.shows_epis")
show_views: Setter[bool] = setter("inspection.shows_views")
show_values: Setter[bool] = setter("inspection.shows_values")
"""Show or hide the epipolar plane images beside the picture, the sheet of all views, the values under the pointer."""
set_opacity: Setter[float] = setter("inspection.opacity", (0.0, 1.0))
"""Set the opacity of overlays."""
set_probe: Setter[Probe | None] = setter("inspection.probe")
"""Set the values under the pointer."""


def set_overlay(state: AppState, kind: OverlayKind | None) -> AppState:
    """Lay a map over the picture instead of a comparison; None takes it away."""
    if kind is None or state.scene is None:
        return replace(state, inspection=replace(state.inspection, overlay=None))
    obstacle = obstacle_to_overlay(state.scene, kind)
    if obstacle:
        return notify(state, Notice(obstacle))
    return replace(state, inspection=replace(state.inspection, overlay=kind, comparison=None))


def compare(state: AppState, kind: Comparison | None) -> AppState:
    """Divide the picture to compare it, instead of an overlay; None ends that."""
    if kind is None or state.scene is None:
        return replace(state, inspection=replace(state.inspection, comparison=None, divider_taken=False))
    if kind == "snapshot" and state.inspection.snapshot is None:
        return notify(state, Notice(NO_SNAPSHOT))
    notices = tuple(notice for notice in state.notices if notice.text != SNAPSHOT_TAKEN)
    return replace(state, notices=notices, inspection=replace(state.inspection, comparison=kind, overlay=None))


def take_snapshot(state: AppState) -> AppState:
    """Remember the present lens, to compare with later."""
    if state.scene is None:
        return state
    taken = replace(state, inspection=replace(state.inspection, snapshot=state.optics))
    return notify(taken, Notice(SNAPSHOT_TAKEN, commands=(COMPARE_SNAPSHOT,)))


def move_divider(state: AppState, place: float) -> AppState:
    """Drag the divider to a place, 0..1 from the left border."""
    divider = clamp(place, DIVIDER_MARGIN, 1 - DIVIDER_MARGIN)
    return replace(state, inspection=replace(state.inspection, divider=divider, divider_taken=True))


def set_hover(state: AppState, hover: Hover | None) -> AppState:
    """Set the pointer's place in the picture; None: it is elsewhere, and the values under it are gone."""
    if hover is None:
        return replace(state, hover=None, inspection=replace(state.inspection, probe=None))
    return replace(state, hover=hover, inspection=replace(state.inspection, place=(hover.x_px, hover.y_px)))


def obstacle_to_overlay(scene: Scene, kind: OverlayKind) -> str:
    """Return why this map cannot be laid over the picture; empty if it can."""
    if kind != "disparity" and scene.plan is None:
        return NO_INPAINTING
    return "" if scene.has_view_disparity else NO_DEPTH


def beside_of(state: AppState) -> Beside:
    """Return the things that are shown beside the picture."""
    scene, inspection = state.scene, state.inspection
    has_filmstrip = state.preferences.shows_filmstrip and state.folder is not None and len(state.folder.photos) > 1
    if scene is None:
        return Beside(has_filmstrip=has_filmstrip)
    has_epis = inspection.shows_epis and max(scene.grid) > 1
    views = (scene.grid.rows, scene.grid.columns) if has_epis else None
    return Beside(views, inspection.shows_values, has_filmstrip)


def view_near(eye: ViewOffset, grid: GridShape) -> ViewIndex:
    """Return the index of the view nearest to a viewpoint."""
    row, column = (min(max(round(at) + n // 2, 0), n - 1) for at, n in zip(eye, grid))
    return row, column


def sheet_cells(picture: Rect, grid: GridShape, ui_scale: float = 1.0) -> tuple[Rect, ...]:
    """Return the rectangles of all views on the sheet, row by row, in the picture's shape."""
    gap = SHEET_GAP * ui_scale
    scale = min(
        (picture.width - gap * (grid.columns + 1)) / (grid.columns * picture.width),
        (picture.height - gap * (grid.rows + 1)) / (grid.rows * picture.height),
    )
    width, height = max(scale, 0.0) * picture.width, max(scale, 0.0) * picture.height
    left = picture.x + (picture.width - grid.columns * (width + gap) + gap) / 2
    top = picture.y + (picture.height - grid.rows * (height + gap) + gap) / 2
    return tuple(
        Rect(left + column * (width + gap), top + row * (height + gap), width, height)
        for row in range(grid.rows)
        for column in range(grid.columns)
    )


def view_at(picture: Rect, grid: GridShape, ui_scale: float, x: float, y: float) -> ViewIndex | None:
    """Return the view of the sheet at a window position; None between views."""
    for i, cell in enumerate(sheet_cells(picture, grid, ui_scale)):
        if cell.contains(x, y):
            return divmod(i, grid.columns)
    return None
