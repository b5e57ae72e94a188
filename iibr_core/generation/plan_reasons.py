"""Why a plan is as it is, in sentences for people."""

from __future__ import annotations

import numpy as np

from iibr_core.generation.cost_model import ParallaxStatistics
from iibr_core.generation.disparity_range import DisparityRange
from iibr_core.inpainting.registry import DEFAULT_INPAINTER, INPAINTERS
from iibr_core.types import FloatImage, GridShape, Quality


def grid_reason(grid: GridShape, parallax_px: float) -> str:
    """Why there are so many views."""
    if grid == (1, 1):
        return "One view: the disparity is the same everywhere, so every viewpoint shows the photo."
    step = parallax_px / (grid.columns - 1)
    return f"{grid.columns} x {grid.rows} views: neighbours differ by {step:.1f} px, the renderer fills in between."


def wild_reasons(given: FloatImage, span: DisparityRange) -> list[str]:
    """A sentence where the map has values far outside its range."""
    far, near = span.low - span.range / 2, span.high + span.range / 2
    count = int(np.count_nonzero((given < far) | (given > near))) if span.range > 0 else 0
    if not count:
        return []
    return [f"{count} pixels lie far beyond that range, as mistakes do: they count as the nearest or the farthest."]


def edge_reasons(statistics: ParallaxStatistics, inpaint: str, outer_views: int) -> list[str]:
    """How much lies near edges, and what fills the holes behind them."""
    near_edges = f"{statistics.edge_share:.1%} of the pixels lie near a depth edge; "
    if not statistics.has_disocclusion:
        return [near_edges + "nothing is disoccluded, so nothing is inpainted."]
    name = inpaint.partition(":")[0]
    why = "nearest to true views, though smooth" if inpaint == DEFAULT_INPAINTER else "as asked"
    reasons = [f"{near_edges}what they hide is inpainted by {name}: {why}."]
    if inpaint not in INPAINTERS:
        reasons.append(f"The model paints up to {outer_views} views, each in seconds on a GPU, in minutes without one.")
    return reasons


def quality_reason(quality: Quality, is_asked: bool) -> str:
    """Why the views are made in this quality."""
    why = ": the trained ray transformer decides where rays are ambiguous."
    if is_asked:
        why = ", as asked."
    elif quality == "fast":
        why = ": no ray is ambiguous."
    return f"{quality.capitalize()} quality{why}"
