"""ScenePlan: which views a scene needs, and why. Nothing is modelled that the disparity does not ask for."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from iibr_core.inpainting.registry import DEFAULT_INPAINTER, INPAINTERS
from iibr_core.method.disparity_range import DisparityRange, measure_disparity_range
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.method.memory import (
    MAKING_BYTES,
    budget_bytes,
    mebibytes,
    require_memory,
    scene_bytes,
    view_bytes,
)
from iibr_core.types import (
    TOTAL_PARALLAX,
    Disparity,
    FloatImage,
    GridShape,
    InputError,
    Photo,
)

STEP_PX = 8.0
"""Largest parallax between neighbouring views for viewing, in pixels: the renderer interpolates along disparity. A
quarter of the views costs a third of a decibel.
"""
MAX_VIEWS_A_SIDE = 9
STILL_PX = 0.5
"""Parallax across the whole grid that cannot be seen, in pixels: the scene is flat."""
MIN_PLANNED_EDGE_PX = 1.5
"""Parallax between neighbouring pixels in the outermost view from which on they are two surfaces, in pixels."""
MAX_COMFORTABLE = 2.0
"""Multiple of the parallax for viewing above which a disparity that is taken as given gets a note."""
MAX_NOISE_PX = 1.0
"""Largest movement of a map's noise from the first view to the last: a range hardly above the noise moves less."""
MAX_DEPTH_STRENGTH = 100.0
"""Largest depth strength: parallax four times as wide as the picture."""


@dataclass(frozen=True)
class PlanOverrides:
    """The user's decisions; None leaves the choice to the plan.

    depth_strength multiplies the parallax that the plan chose. focus_disparity (px per view step, as given) is the
    plane that stays still. inpaint: way of filling holes, see `load_inpainter`.
    """

    grid: GridShape | None = None
    depth_strength: float = 1.0
    focus_disparity: float | None = None
    inpaint: str = DEFAULT_INPAINTER


@dataclass(frozen=True)
class ScenePlan:
    """The choices for one scene.

    grid: stored views. disparity_scale, disparity_zero: the field's disparity is (given - zero) * scale. given_range:
    farther and nearer ones count as its ends; None if all count as they are. disparity_range_px: least and greatest
    field disparity (px per view step). edge_fraction: share of pixels at a depth edge. has_disocclusion: whether any
    view shows what the photo hides. field_bytes: memory of the light field. reasons: the same in sentences. notes:
    sentences that the user should read.
    """

    grid: GridShape
    disparity_scale: float
    disparity_zero: float
    disparity_range_px: tuple[float, float]
    edge_fraction: float
    has_disocclusion: bool
    field_bytes: int
    reasons: tuple[str, ...]
    given_range: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    def field_disparity(self, given: Disparity) -> Disparity:
        """Return the disparity that the light field is generated from (px per view step of this plan's grid)."""
        counted = given.values if self.given_range is None else np.clip(given.values, *self.given_range)
        values = (counted - np.float32(self.disparity_zero)) * np.float32(self.disparity_scale)
        return Disparity(values, given.source, given.notes)


def plan_for_viewing(
    photo: Photo, disparity: Disparity, overrides: PlanOverrides | None = None, keeps_views: bool = True
) -> ScenePlan:
    """Plan for the viewer: choose the plane that stays still, the baseline and the grid.

    keeps_views: False if each view is written and forgotten. Raises InputError if an override is out of range, or if a
    grid that the user asked for does not fit into memory.
    """
    wanted = overrides or PlanOverrides()
    if not abs(wanted.depth_strength) <= MAX_DEPTH_STRENGTH:
        raise InputError(f"depth strength {wanted.depth_strength:g}: give a number up to {MAX_DEPTH_STRENGTH:g}")
    span = measure_disparity_range(disparity.values)
    given = disparity.values
    disparity = replace(disparity, values=np.clip(given, span.low, span.high))
    zero = float(np.median(disparity.values)) if wanted.focus_disparity is None else wanted.focus_disparity
    width = photo.size.width
    parallax_px = _parallax_px(span, width) * abs(wanted.depth_strength)
    grid = wanted.grid or _grid_for(parallax_px, photo)
    steps = max(grid.rows, grid.columns) - 1
    scale = parallax_px / steps / span.range * np.sign(wanted.depth_strength) if steps and parallax_px else 0.0
    reasons = [_grid_reason(grid, parallax_px, wanted.grid is not None)]
    if parallax_px:
        reasons.append(
            f"The nearest moves {parallax_px:.0f} px against the farthest, {parallax_px / width:.1%} of the width."
        )
    reasons += _outlier_reasons(given, span)
    plan = _complete_plan(photo, disparity, grid, (float(scale), zero), reasons, wanted.inpaint)
    _require_room(plan, photo, keeps_views)
    return replace(plan, given_range=(span.low, span.high))


def plan_literal(
    photo: Photo,
    disparity: Disparity,
    grid: GridShape,
    keeps_views: bool = False,
    inpaint: str = DEFAULT_INPAINTER,
) -> ScenePlan:
    """Plan for `--literal`: the given disparity counts in pixels, views are at integer steps.

    Arguments as of `plan_for_viewing`. Raises InputError if the grid has no view or does not fit into memory.
    """
    reasons = [f"{grid.columns} x {grid.rows} views at the given disparity."]
    plan = _complete_plan(photo, disparity, grid, (1.0, 0.0), reasons, inpaint)
    _require_room(plan, photo, keeps_views)
    return replace(plan, notes=_wide_notes(plan, photo.size.width))


def _parallax_px(span: DisparityRange, width: int) -> float:
    """Return how far the nearest moves against the farthest from the first view to the last, in pixels."""
    if span.range <= 0:
        return 0.0
    carried_px = MAX_NOISE_PX * span.range / span.noise if span.noise > 0 else np.inf
    return float(min(TOTAL_PARALLAX * width, carried_px))


def _grid_for(parallax_px: float, photo: Photo) -> GridShape:
    """Return the smallest odd grid whose neighbouring views differ by at most STEP_PX, as far as memory allows."""
    if parallax_px < STILL_PX:
        return GridShape(1, 1)
    side = min(2 * math.ceil(parallax_px / STEP_PX / 2) + 1, MAX_VIEWS_A_SIDE)
    pixels, budget = math.prod(photo.size), budget_bytes()
    while side > 3 and scene_bytes(pixels, side * side * view_bytes(pixels, photo.is_hdr)) > budget:
        side -= 2
    return GridShape(side, side)


def _complete_plan(
    photo: Photo,
    disparity: Disparity,
    grid: GridShape,
    scale_and_zero: tuple[float, float],
    reasons: list[str],
    inpaint: str,
) -> ScenePlan:
    """Return the plan with everything that follows from grid, scale and zero."""
    if grid.rows < 1 or grid.columns < 1:
        raise InputError(f"grid {grid.columns}x{grid.rows}: give at least one view each way, such as 9")
    scale, zero = scale_and_zero
    field = (disparity.values - np.float32(zero)) * np.float32(scale)
    outer = outer_views_of_grid(grid)
    moved_px = field * np.float32(max((abs(part) for at in outer for part in at), default=0.0))
    edge_share, has_disocclusion = _edge_share(moved_px), bool(np.abs(moved_px).max() > STILL_PX)
    pixels = math.prod(photo.size)
    field_bytes = grid.rows * grid.columns * view_bytes(pixels, photo.is_hdr)
    memory = f"Memory: {mebibytes(field_bytes)} for the views, {mebibytes(pixels * MAKING_BYTES)} to make them."
    return ScenePlan(
        grid,
        scale,
        zero,
        (float(field.min()), float(field.max())),
        edge_share,
        has_disocclusion,
        field_bytes,
        (*reasons, *_edge_reasons(edge_share, has_disocclusion, inpaint, len(outer)), memory),
    )


def _edge_share(moved_px: FloatImage) -> float:
    """Return the share of pixels at a depth edge, of a map (H, W) in px of parallax in the outermost view."""
    is_edge = np.zeros(moved_px.shape, np.bool_)
    is_edge[:, 1:] = np.abs(np.diff(moved_px, axis=1)) > MIN_PLANNED_EDGE_PX
    is_edge[1:] |= np.abs(np.diff(moved_px, axis=0)) > MIN_PLANNED_EDGE_PX
    return float(is_edge.mean())


def _require_room(plan: ScenePlan, photo: Photo, keeps_views: bool) -> None:
    what = f"{plan.grid.columns} x {plan.grid.rows} views of {photo.name} ({photo.size})"
    require_memory(scene_bytes(math.prod(photo.size), plan.field_bytes if keeps_views else 0), what)


def _wide_notes(plan: ScenePlan, width: int) -> tuple[str, ...]:
    """Return a sentence if the views differ by far more than those that are planned for viewing."""
    low, high = plan.disparity_range_px
    moved_px = (max(plan.grid) - 1) * (high - low)
    if moved_px <= MAX_COMFORTABLE * TOTAL_PARALLAX * width:
        return ()
    return (
        f"The nearest moves {moved_px:.0f} px against the farthest from the first view to the last,"
        f" {moved_px / width:.0%} of the width: most of it is inpainted. In the window it is {TOTAL_PARALLAX:.0%}.",
    )


def _grid_reason(grid: GridShape, parallax_px: float, is_asked: bool) -> str:
    if is_asked:
        return f"{grid.columns} x {grid.rows} views, as asked."
    if grid == (1, 1):
        return "One view: the disparity is the same everywhere, so every viewpoint shows the photo."
    step = parallax_px / (grid.columns - 1)
    return f"{grid.columns} x {grid.rows} views: neighbours differ by {step:.1f} px, the renderer fills in between."


def _outlier_reasons(given: FloatImage, span: DisparityRange) -> list[str]:
    """Return a sentence if the map has values far outside its range."""
    far, near = span.low - span.range / 2, span.high + span.range / 2
    count = int(np.count_nonzero((given < far) | (given > near))) if span.range > 0 else 0
    if not count:
        return []
    return [f"{count} pixels lie far beyond that range, as mistakes do: they count as the nearest or the farthest."]


def _edge_reasons(edge_share: float, has_disocclusion: bool, inpaint: str, outer_views: int) -> list[str]:
    """Return how much lies near edges, and what fills the holes behind them."""
    near_edges = f"{edge_share:.1%} of the pixels lie at a depth edge; "
    if not has_disocclusion:
        return [near_edges + "nothing is disoccluded, so nothing is inpainted."]
    name = inpaint.partition(":")[0]
    why = "nearest to true views, though smooth" if inpaint == DEFAULT_INPAINTER else "as asked"
    reasons = [f"{near_edges}what they hide is inpainted by {name}: {why}."]
    if inpaint not in INPAINTERS:
        reasons.append(f"The model paints up to {outer_views} views, each in seconds on a GPU, in minutes without one.")
    return reasons
