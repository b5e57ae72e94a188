"""What inspection asks for in this state: which view, which work in the background, which images. Records, no GL."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape, ViewOffset
from viewer.model.layout import Beside
from viewer.model.state.app_state import AppState
from viewer.model.state.inspection import Comparison, GroundTruth, ViewIndex

SHEET_GAP = 3.0
DIFFERENCE_GAIN = 4
"""Differences are shown so many times as large."""


@dataclass(frozen=True)
class InspectionRequest:
    """Something to be worked out in the background.

    view: in the scene's grid, or the ground truth's ("truth"). is_scored: whether PSNR and FLIP are wanted too.
    """

    generation: int
    kind: Literal["truth", "entropy"]
    view: ViewIndex
    truth: GroundTruth | None = None
    is_scored: bool = False


@dataclass(frozen=True)
class InspectionTextures:
    """GL names of the textures that inspection shows; None where nothing is shown, or not yet. Rows top-down.

    shown: records of what is in them: they look different when these differ.
    """

    strip_across: int | None = None
    strip_down: int | None = None
    sheet: int | None = None
    overlay: int | None = None
    left: int | None = None
    right: int | None = None
    difference: int | None = None
    minimap: int | None = None
    shown: tuple[object, ...] = ()


NO_INSPECTION_TEXTURES = InspectionTextures()


def beside_of(state: AppState) -> Beside:
    """What is shown beside the picture."""
    scene, inspection = state.scene, state.inspection
    has_filmstrip = state.preferences.shows_filmstrip and state.folder is not None and len(state.folder.photos) > 1
    if scene is None:
        return Beside(has_filmstrip=has_filmstrip)
    has_epis = inspection.shows_epis and max(scene.grid) > 1
    views = (scene.grid.rows, scene.grid.columns) if has_epis else None
    return Beside(views, inspection.shows_values, has_filmstrip)


def view_near(eye: ViewOffset, grid: GridShape) -> ViewIndex:
    """Index of the view nearest to a viewpoint."""
    row, column = (min(max(round(at) + n // 2, 0), n - 1) for at, n in zip(eye, grid))
    return row, column


def view_label(view: ViewIndex, grid: GridShape) -> str:
    """Where a view stands, seen from the middle: "view 2 → 1 ↑", "middle view"."""
    t, s = (round(value) for value in grid.offset(*view))
    parts = [
        f"{abs(value)} {sign}" for value, sign in ((s, "←" if s < 0 else "→"), (t, "↑" if t < 0 else "↓")) if value
    ]
    return f"view {' '.join(parts)}" if parts else "middle view"


def view_to_compare(scene: Scene, eye: ViewOffset, kind: Comparison, truth: GroundTruth | None) -> ViewIndex:
    """Which view is compared from this viewpoint. The ground truth's own grid may have another size."""
    if kind == "photo":
        return scene.grid.centre
    if truth is None:
        return view_near(eye, scene.grid)
    reach = ((own - 1) / 2 for own in scene.grid)
    t, s = (at / r * ((n - 1) / 2) if r else 0.0 for at, r, n in zip(eye, reach, truth.grid))
    return view_near(ViewOffset(t, s), truth.grid)


def grid_to_compare(scene: Scene, kind: Comparison, truth: GroundTruth | None) -> GridShape:
    """The grid that compared views belong to."""
    return truth.grid if kind == "truth" and truth is not None else scene.grid


def make_inspection_request(
    state: AppState, is_moving: bool, before: InspectionRequest | None
) -> InspectionRequest | None:
    """What is to be worked out now. While the viewpoint moves nothing slow is begun: what is there stays."""
    scene, inspection = state.scene, state.inspection
    if scene is None:
        return None
    kind = inspection.comparison
    if inspection.overlay == "entropy":
        return InspectionRequest(state.generation, "entropy", view_near(state.optics.eye, scene.grid))
    if kind != "truth":
        return None
    view = view_to_compare(scene, state.optics.eye, kind, inspection.truth)
    wanted = InspectionRequest(state.generation, kind, view, inspection.truth, not is_moving)
    return before if is_moving and before == replace(wanted, is_scored=True) else wanted


def sheet_cells(picture: Rect, grid: GridShape, ui_scale: float = 1.0) -> tuple[Rect, ...]:
    """Where each view lies on the sheet over the picture, row by row; all have the picture's shape."""
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
    """The view of the sheet at a window position; None between them."""
    for i, cell in enumerate(sheet_cells(picture, grid, ui_scale)):
        if cell.contains(x, y):
            return divmod(i, grid.columns)
    return None
