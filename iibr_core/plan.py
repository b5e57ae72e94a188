"""ScenePlan: what this scene needs, and why. Nothing is modelled that the disparity does not ask for."""

from __future__ import annotations

import os
from dataclasses import dataclass
from math import ceil

import numpy as np
import psutil
from numpy.typing import NDArray

from iibr_core.types import Disparity, FloatImage, GridShape, InputError, Photo

TOTAL_PARALLAX = 0.04
"""For viewing: how far the nearest moves against the farthest across the grid, as a share of the photo's width."""
STEP_PX = 4.0
"""For viewing: neighbouring views may differ by this much parallax; the renderer interpolates along disparity."""
MOST_VIEWS_A_SIDE = 9
STILL_PX = 0.5
"""Less parallax than this across the whole grid cannot be seen: the scene is flat."""
GAP_PX = 1.0
"""A depth edge disoccludes something if it opens a gap wider than this in the outermost view."""
NEAR_EDGE_PX = 3
RAY_US = 2.0
"""What the ray transformer takes a ray on one core: hypotheses, features, weights, colours."""
ROBUST_PERCENTILES = (1.0, 99.0)
"""A few wild disparities must not set the baseline."""
DISPARITY_BYTES = 4
RAY_BYTES = 33
"""Of one pixel of one source image: colours, disparity, coverage, flag (rays.RaySet), and what lies around it."""
WORKING_BYTES = 28
"""Of one pixel of a view in the making: float colours, disparity, flags, and parts of rows before they are joined."""
BAND_BYTES = 16 << 20
"""Of the candidates of one band of rows (synthesis.MOST_BAND_PIXELS)."""
FARTHEST_VIEWS = 8


@dataclass(frozen=True)
class PlanOverrides:
    """What the user decided; None leaves the choice to the plan.

    depth_strength multiplies the parallax the plan chose; focus_disparity (px per view step, as given) is the plane
    that stays still.
    """

    grid: GridShape | None = None
    depth_strength: float = 1.0
    focus_disparity: float | None = None
    memory_bytes: int | None = None


@dataclass(frozen=True)
class ScenePlan:
    """The choices for one scene.

    grid: stored views. disparity_scale, disparity_zero: the field's disparity is (given - zero) * scale.
    disparity_range_px: least and greatest field disparity (px per view step). edge_fraction: share of pixels within 3
    px of a depth edge, about that of the rays that balanced quality asks the transformer. has_disocclusion: whether
    any view shows what the photo hides. field_bytes, peak_bytes: memory of the light field, and at most while
    generating. reasons: the same in sentences.
    """

    grid: GridShape
    disparity_scale: float
    disparity_zero: float
    disparity_range_px: tuple[float, float]
    edge_fraction: float
    has_disocclusion: bool
    field_bytes: int
    peak_bytes: int
    reasons: tuple[str, ...]

    def field_disparity(self, given: Disparity) -> Disparity:
        """The disparity the light field is generated from (px per view step of this plan's grid)."""
        values = (given.values - np.float32(self.disparity_zero)) * np.float32(self.disparity_scale)
        return Disparity(values, given.source, given.notes)


def plan_for_viewing(photo: Photo, disparity: Disparity, overrides: PlanOverrides | None = None) -> ScenePlan:
    """Plan for the viewer: picks the focus plane that stays still, the baseline and the grid.

    Raises InputError if an override is out of range, or if a grid the user asked for does not fit into memory.
    """
    wanted = overrides or PlanOverrides()
    if not np.isfinite(wanted.depth_strength):
        raise InputError(f"--depth-strength {wanted.depth_strength}: give a finite number")
    budget = _memory_budget(wanted.memory_bytes)
    low, high = (float(p) for p in np.percentile(disparity.values, ROBUST_PERCENTILES))
    zero = float(np.median(disparity.values)) if wanted.focus_disparity is None else wanted.focus_disparity
    width = photo.size[1]
    parallax_px = (
        TOTAL_PARALLAX * width * abs(wanted.depth_strength) if high - low > 1e-6 * max(abs(low), abs(high), 1) else 0.0
    )
    reasons = []
    if wanted.grid is not None:
        grid = wanted.grid
        reasons.append(f"{grid.columns} x {grid.rows} views, as asked.")
    else:
        grid = _grid_for(parallax_px, _view_bytes(photo), budget - _generating_bytes(photo, FARTHEST_VIEWS))
        reasons.append(_grid_reason(grid, parallax_px))
    steps = max(grid.rows, grid.columns) - 1
    scale = parallax_px / steps / (high - low) * np.sign(wanted.depth_strength) if steps and parallax_px else 0.0
    if parallax_px:
        reasons.append(
            f"The nearest moves {parallax_px:.0f} px against the farthest, {parallax_px / width:.1%} of the width."
        )
    return _finished(photo, disparity, grid, float(scale), zero, budget, reasons)


def plan_literal(photo: Photo, disparity: Disparity, grid: GridShape, memory_bytes: int | None = None) -> ScenePlan:
    """Plan for `iibr generate --grid`: the given disparity is taken as it is, views at integer steps.

    Raises InputError if the grid has no view or generating it does not fit into memory.
    """
    reasons = [f"{grid.columns} x {grid.rows} views at the given disparity."]
    return _finished(photo, disparity, grid, 1.0, 0.0, _memory_budget(memory_bytes), reasons)


def _memory_budget(memory_bytes: int | None) -> int:
    budget = psutil.virtual_memory().total // 4 if memory_bytes is None else memory_bytes
    if budget <= 0:
        raise InputError(f"--memory {memory_bytes}: give a positive number of bytes")
    return budget


def _view_bytes(photo: Photo) -> int:
    height, width = photo.size
    return height * width * (3 * (2 if photo.is_hdr else 1) + DISPARITY_BYTES)


def _generating_bytes(photo: Photo, inpainted_views: int) -> int:
    """Memory for the ray set (the photo, its fringe, inpainted views) and the views in flight, one a thread."""
    pixels = photo.size[0] * photo.size[1]
    at_work = (os.cpu_count() or 1) * (pixels * WORKING_BYTES + _view_bytes(photo) + BAND_BYTES)
    return pixels * RAY_BYTES * (2 + inpainted_views) + at_work


def _grid_for(parallax_px: float, view_bytes: int, budget: int) -> GridShape:
    """The smallest odd grid whose neighbouring views differ by at most STEP_PX, as far as memory allows."""
    if parallax_px < STILL_PX:
        return GridShape(1, 1)
    side = min(max(ceil(parallax_px / STEP_PX) // 2 * 2 + 1, 3), MOST_VIEWS_A_SIDE)
    while side > 3 and side * side * view_bytes > budget:
        side -= 2
    return GridShape(side, side)


def _grid_reason(grid: GridShape, parallax_px: float) -> str:
    if grid == (1, 1):
        return "One view: the disparity is the same everywhere, so every viewpoint shows the photo."
    step = parallax_px / (grid.columns - 1)
    return f"{grid.columns} x {grid.rows} views: neighbours differ by {step:.1f} px, the renderer fills in between."


def _finished(
    photo: Photo, disparity: Disparity, grid: GridShape, scale: float, zero: float, budget: int, reasons: list[str]
) -> ScenePlan:
    """The plan with what follows from grid and scale."""
    if grid.rows < 1 or grid.columns < 1:
        raise InputError(f"--grid {grid.columns}x{grid.rows}: give at least one view each way, such as 9")
    field = (disparity.values - np.float32(zero)) * np.float32(scale)
    outermost = max(max(map(abs, grid.offset(v, u))) for v in (0, grid.rows - 1) for u in (0, grid.columns - 1))
    edges = _depth_edges(field, outermost)
    leaves_frame = float(np.abs(field).max()) * outermost > STILL_PX
    has_disocclusion = bool(leaves_frame or edges.any())
    edge_fraction = float(_grown(edges, NEAR_EDGE_PX).mean())
    field_bytes = grid.rows * grid.columns * _view_bytes(photo)
    peak_bytes = _generating_bytes(photo, FARTHEST_VIEWS if has_disocclusion else 0)
    if peak_bytes > budget:
        raise InputError(
            f"generating from {photo.name} takes {peak_bytes / 2**20:.0f} MiB, the budget is {budget / 2**20:.0f} MiB:"
            " raise --memory or lower --max-pixels"
        )
    reasons.append(
        f"{edge_fraction:.1%} of the pixels lie near a depth edge; "
        + (
            "holes behind them are inpainted."
            if has_disocclusion
            else "nothing is disoccluded, so nothing is inpainted."
        )
    )
    if has_disocclusion:
        reasons.append(_transformer_reason(edge_fraction, (grid.rows * grid.columns - 1) * field.size))
    reasons.append(f"Memory: {field_bytes / 2**20:.0f} MiB for the views, {peak_bytes / 2**20:.0f} MiB to make them.")
    extent = (float(field.min()), float(field.max()))
    return ScenePlan(
        grid, scale, zero, extent, edge_fraction, has_disocclusion, field_bytes, peak_bytes, tuple(reasons)
    )


def _transformer_reason(contested: float, rays: int) -> str:
    """contested: share of the rays that several surfaces contest."""
    exact_s = rays * RAY_US * 1e-6 / (os.cpu_count() or 1)
    return (
        f"The ray transformer weighs {contested * rays / 1e6:.1f} of {rays / 1e6:.1f} million rays in balanced quality,"
        f" {contested * exact_s:.1f} s; all in exact quality, {exact_s:.0f} s."
    )


def _depth_edges(field: FloatImage, outermost: float) -> NDArray[np.bool_]:
    """(H, W) bool: True on both sides of a step that opens a gap in the outermost view."""
    edges = np.zeros(field.shape, np.bool_)
    for axis in (0, 1):
        gap = np.abs(np.diff(field, axis=axis)) * outermost > GAP_PX
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        edges[tuple(before)] |= gap
        edges[tuple(after)] |= gap
    return edges


def _grown(mask: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """The mask grown by a square of this many pixels each way."""
    grown = mask.copy()
    for axis in (0, 1):
        base = grown.copy()
        for shift in range(1, pixels + 1):
            before, after = [slice(None)] * 2, [slice(None)] * 2
            before[axis], after[axis] = slice(None, -shift), slice(shift, None)
            grown[tuple(before)] |= base[tuple(after)]
            grown[tuple(after)] |= base[tuple(before)]
    return grown
