"""ScenePlan: what this scene costs, and why. Nothing is modelled that the disparity does not ask for.

It leaves alone what measures the same either way (docs/speed.md): with K = 3 or 8 candidates a ray takes the time of 5,
and half floats gain 0.03 dB over bytes for 1.4 times the memory of the field, so that 8 bits stay bytes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from iibr_core.generation.cost_model import (
    NO_COST,
    STILL_PX,
    CostEstimates,
    estimate_costs,
    largest_offset,
    measure_parallax,
)
from iibr_core.generation.disparity_range import measure_disparity_range
from iibr_core.generation.memory import MAKING_BYTES, budget_bytes, mebibytes, require_memory, scene_bytes, view_bytes
from iibr_core.generation.outer_views import outer_views_of_grid
from iibr_core.generation.plan_reasons import edge_reasons, grid_reason, quality_reason, wild_reasons
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.types import (
    DEFAULT_QUALITY,
    TOTAL_PARALLAX,
    Disparity,
    GridShape,
    InputError,
    Photo,
    Quality,
)

STEP_PX = 8.0
"""For viewing: neighbouring views may differ by this much parallax; the renderer interpolates along disparity. A
quarter of the views costs a third of a decibel (docs/speed.md).
"""
MOST_VIEWS_A_SIDE = 9
MOST_COMFORTABLE = 2.0
"""Times the parallax for viewing: a disparity that is taken as given and moves more is told."""
MOST_NOISE_PX = 1.0
"""So much may a map's noise move from the first view to the last: a range that hardly exceeds the noise moves less."""
MOST_STRENGTH = 100.0
"""Parallax four times as wide as the picture."""


@dataclass(frozen=True)
class PlanOverrides:
    """What the user decided; None leaves the choice to the plan.

    depth_strength multiplies the parallax the plan chose; focus_disparity (px per view step, as given) is the plane
    that stays still. quality: that views will be made in. inpaint: what
    will fill their holes, see `load_inpainter`.
    """

    grid: GridShape | None = None
    depth_strength: float = 1.0
    focus_disparity: float | None = None
    quality: Quality | None = None
    inpaint: str = DEFAULT_INPAINTER


@dataclass(frozen=True)
class ScenePlan:
    """The choices for one scene.

    grid: stored views. disparity_scale, disparity_zero: the field's disparity is (given - zero) * scale. given_range:
    farther and nearer ones count as its ends; None where all count as they are.
    disparity_range_px: least and greatest field disparity (px per view step). edge_fraction: share of pixels within 3
    px of a depth edge. has_disocclusion: whether any view shows what the photo hides. field_bytes: memory
    of the light field. reasons: the same in sentences. costs:
    time and memory of making all views, in each quality. quality: the one to make them in. draft_bytes: what drafts of
    views may take. notes: what the user should know of the choices, one sentence each.
    """

    grid: GridShape
    disparity_scale: float
    disparity_zero: float
    disparity_range_px: tuple[float, float]
    edge_fraction: float
    has_disocclusion: bool
    field_bytes: int
    reasons: tuple[str, ...]
    costs: CostEstimates = NO_COST
    given_range: tuple[float, float] | None = None
    quality: Quality = DEFAULT_QUALITY
    draft_bytes: int = 0
    notes: tuple[str, ...] = ()

    def field_disparity(self, given: Disparity) -> Disparity:
        """The disparity the light field is generated from (px per view step of this plan's grid)."""
        counted = given.values if self.given_range is None else np.clip(given.values, *self.given_range)
        values = (counted - np.float32(self.disparity_zero)) * np.float32(self.disparity_scale)
        return Disparity(values, given.source, given.notes)


def plan_for_viewing(
    photo: Photo, disparity: Disparity, overrides: PlanOverrides | None = None, keeps_views: bool = True
) -> ScenePlan:
    """Plan for the viewer: picks the focus plane that stays still, the baseline and the grid.

    keeps_views: else each is written and forgotten. Raises InputError if an override is out of range, or if a grid the
    user asked for does not fit into memory.
    """
    wanted = overrides or PlanOverrides()
    if not abs(wanted.depth_strength) <= MOST_STRENGTH:
        raise InputError(f"--depth-strength {wanted.depth_strength:g}: give a number up to {MOST_STRENGTH:g}")
    span = measure_disparity_range(disparity.values)
    given = disparity.values
    disparity = replace(disparity, values=np.clip(given, span.low, span.high))
    zero = float(np.median(disparity.values)) if wanted.focus_disparity is None else wanted.focus_disparity
    width = photo.size.width
    parallax_px = 0.0
    if span.range > 0:
        carried_px = MOST_NOISE_PX * span.range / span.noise if span.noise > 0 else np.inf
        usual_px = TOTAL_PARALLAX * disparity.viewing_share * width
        parallax_px = min(usual_px, carried_px) * abs(wanted.depth_strength)
    reasons = []
    if wanted.grid is not None:
        grid = wanted.grid
        reasons.append(f"{grid.columns} x {grid.rows} views, as asked.")
    else:
        grid = _grid_for(parallax_px, photo)
        reasons.append(grid_reason(grid, parallax_px))
    steps = max(grid.rows, grid.columns) - 1
    scale = parallax_px / steps / span.range * np.sign(wanted.depth_strength) if steps and parallax_px else 0.0
    if parallax_px:
        reasons.append(
            f"The nearest moves {parallax_px:.0f} px against the farthest, {parallax_px / width:.1%} of the width."
        )
    reasons += wild_reasons(given, span)
    plan = _complete_plan(photo, disparity, grid, float(scale), zero, reasons, wanted.quality, wanted.inpaint)
    _require_room(plan, photo, keeps_views)
    return replace(plan, given_range=(span.low, span.high))


def plan_literal(
    photo: Photo,
    disparity: Disparity,
    grid: GridShape,
    quality: Quality | None = None,
    keeps_views: bool = False,
    inpaint: str = DEFAULT_INPAINTER,
) -> ScenePlan:
    """Plan for `--literal`: the given disparity is taken as it is, views at integer steps.

    quality: None leaves it to the plan. inpaint: see `PlanOverrides`. keeps_views: else each is written and forgotten.
    Raises InputError if the grid has no view or generating it does not fit into memory.
    """
    reasons = [f"{grid.columns} x {grid.rows} views at the given disparity."]
    plan = _complete_plan(photo, disparity, grid, 1.0, 0.0, reasons, quality, inpaint)
    _require_room(plan, photo, keeps_views)
    return replace(plan, notes=_wide_notes(plan, photo.size.width))


def _wide_notes(plan: ScenePlan, width: int) -> tuple[str, ...]:
    """A sentence where the views differ by far more than those that are planned for viewing."""
    low, high = plan.disparity_range_px
    moved_px = (max(plan.grid) - 1) * (high - low)
    if moved_px <= MOST_COMFORTABLE * TOTAL_PARALLAX * width:
        return ()
    return (
        f"The nearest moves {moved_px:.0f} px against the farthest from the first view to the last,"
        f" {moved_px / width:.0%} of the width: most of it is inpainted. In the window it is {TOTAL_PARALLAX:.0%}.",
    )


def _require_room(plan: ScenePlan, photo: Photo, keeps_views: bool) -> None:
    what = f"{plan.grid.columns} x {plan.grid.rows} views of {photo.name} ({photo.size})"
    require_memory(scene_bytes(math.prod(photo.size), plan.field_bytes if keeps_views else 0), what)


def _grid_for(parallax_px: float, photo: Photo) -> GridShape:
    """Return the smallest odd grid whose neighbouring views differ by at most STEP_PX, as far as memory allows."""
    if parallax_px < STILL_PX:
        return GridShape(1, 1)
    side = min(2 * ceil(parallax_px / STEP_PX / 2) + 1, MOST_VIEWS_A_SIDE)
    pixels, budget = math.prod(photo.size), budget_bytes()
    while side > 3 and scene_bytes(pixels, side * side * view_bytes(pixels, photo.is_hdr)) > budget:
        side -= 2
    return GridShape(side, side)


def _complete_plan(
    photo: Photo,
    disparity: Disparity,
    grid: GridShape,
    scale: float,
    zero: float,
    reasons: list[str],
    wanted: Quality | None,
    inpaint: str,
) -> ScenePlan:
    """The plan with what follows from grid and scale. wanted: the quality the user asked for."""
    if grid.rows < 1 or grid.columns < 1:
        raise InputError(f"--grid {grid.columns}x{grid.rows}: give at least one view each way, such as 9")
    field = (disparity.values - np.float32(zero)) * np.float32(scale)
    statistics = measure_parallax(field, largest_offset(grid))
    costs = estimate_costs(statistics, grid)
    quality = wanted or ("balanced" if statistics.ambiguous_share(1.0) > 0 else "fast")
    pixels = math.prod(photo.size)
    field_bytes = grid.rows * grid.columns * view_bytes(pixels, photo.is_hdr)
    left = budget_bytes() - scene_bytes(pixels, field_bytes)
    draft_bytes = max(min(costs.of(quality).draft_bytes, left), 0)
    return ScenePlan(
        grid,
        scale,
        zero,
        (float(field.min()), float(field.max())),
        statistics.edge_share,
        statistics.has_disocclusion,
        field_bytes,
        (
            *reasons,
            *edge_reasons(statistics, inpaint, len(outer_views_of_grid(grid))),
            quality_reason(quality, wanted is not None),
            f"Memory: {mebibytes(field_bytes)} for the views, {mebibytes(pixels * MAKING_BYTES)} to make them.",
        ),
        costs,
        quality=quality,
        draft_bytes=draft_bytes,
    )
