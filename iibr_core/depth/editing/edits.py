"""A user's edits of a disparity map (inversion, clips, gamma, brush strokes) as frozen records; the tone curve.

Strengths, clips and places are shares of the map's range or of the photo's size, so that edits fit any scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isclose, isfinite
from typing import Literal

import numpy as np

from iibr_core.types import FloatImage, InputError

BrushTool = Literal["nearer", "farther", "smooth", "level", "fill", "forward", "back"]
BRUSH_TOOLS: tuple[BrushTool, ...] = ("nearer", "farther", "smooth", "level", "fill")
DEPTH_TOOLS: tuple[BrushTool, ...] = ("level", "fill")
"""Tools that paint one depth: along the stroke, or on the surface under it (the bucket)."""
SURFACE_TOOLS: tuple[BrushTool, ...] = ("fill", "forward", "back")
"""Tools that change the whole surface under the stroke: to one depth, or by the stroke's strength."""

GAMMA_LIMITS = (0.25, 4.0)
RADIUS_LIMITS = (0.002, 0.25)
TOLERANCE_LIMITS = (0.25, 4.0)
FEATHER_LIMITS = (0.0, 0.1)
MAX_PATCHES = 1000
"""Largest number of brush paths that change one selection."""
MAX_POINTS = 10_000
"""Largest number of points of one stroke."""
EXTENT_PERCENTILES = (0.1, 99.9)
"""Percentiles of a map that count as its far and near end: a few wild values do not."""
HISTOGRAM_BINS = 64


@dataclass(frozen=True)
class Patch:
    """A path of the brush that adds to a selected surface, or erases from it. points, radius: see `Stroke`."""

    points: tuple[tuple[float, float], ...]
    radius: float
    erases: bool = False


@dataclass(frozen=True)
class Stroke:
    """One stroke of the brush.

    points: its path, (x, y) as shares of the photo's width and height (0 = left or top border). radius: share of the
    photo's width. strength: 0..1, the largest change: for "nearer", "farther", "forward" and "back" as a share of the
    map's range, for "smooth" of the way to the smoothed map, for "level" and "fill" of the way to the depth that the
    map had before the stroke at the place `taken_from`, or if that is None at the first point. tolerance: factor of
    the contrast that ends a surface, for the tools that change a surface. patches: what "forward" and "back" change
    beside the surfaces under the points, or leave. feather: share of the photo's width over which their change fades.
    """

    tool: BrushTool
    points: tuple[tuple[float, float], ...]
    radius: float
    strength: float
    taken_from: tuple[float, float] | None = None
    tolerance: float = 1.0
    patches: tuple[Patch, ...] = ()
    feather: float = 0.0

    def radius_px(self, width: int) -> float:
        """Return the radius in pixels of a map of this width, at least one."""
        return max(self.radius * width, 1.0)


@dataclass(frozen=True)
class DepthEdits:
    """All edits of a map, in this order: inversion, clips, gamma, strokes. The default changes nothing.

    far_clip, near_clip: shares of the map's range, 0 = far end, 1 = near end; values beyond are moved there, 0 and 1
    clip nothing. gamma: above 1 the far part is spread less, below 1 more.
    """

    is_inverted: bool = False
    far_clip: float = 0.0
    near_clip: float = 1.0
    gamma: float = 1.0
    strokes: tuple[Stroke, ...] = ()

    @property
    def tone(self) -> DepthEdits:
        """The same edits without strokes."""
        return DepthEdits(self.is_inverted, self.far_clip, self.near_clip, self.gamma)


UNEDITED = DepthEdits()


@dataclass(frozen=True)
class Levels:
    """Histogram of a map from `low` to `high` (px per view step), in bins of equal width."""

    low: float
    high: float
    counts: tuple[int, ...]


def require_sound(edits: DepthEdits) -> None:
    """Raise InputError if edits from a file hold a value that is not finite or out of its limits."""
    checks = [
        ("gamma", edits.gamma, GAMMA_LIMITS),
        ("near clip", edits.near_clip, (edits.far_clip, 1.0)),
        ("far clip", edits.far_clip, (0.0, 1.0)),
    ]
    for stroke in edits.strokes:
        if stroke.tool not in (*BRUSH_TOOLS, *SURFACE_TOOLS) or not 1 <= len(stroke.points) <= MAX_POINTS:
            raise InputError(f"depth edits: a stroke {stroke.tool!r} with {len(stroke.points)} points; paint it again")
        paths = [patch.points for patch in stroke.patches]
        if len(paths) > MAX_PATCHES or not all(1 <= len(points) <= MAX_POINTS for points in paths):
            raise InputError(f"depth edits: a selection with {len(paths)} brush paths; select it again")
        radii = stroke.radius, *(patch.radius for patch in stroke.patches)
        checks += [("brush radius", radius, RADIUS_LIMITS) for radius in radii]
        checks += [("brush strength", stroke.strength, (0.0, 1.0)), ("feather", stroke.feather, FEATHER_LIMITS)]
        checks.append(("tolerance", stroke.tolerance, TOLERANCE_LIMITS))
        places = (*stroke.points, *([stroke.taken_from] if stroke.taken_from else []), *(at for p in paths for at in p))
        checks += [("place of a stroke", at, (-inf, inf)) for place in places for at in place]
    for name, value, (low, high) in checks:
        if not (isfinite(value) and low <= value <= high):
            raise InputError(f"depth edits: {name} {value} is not from {low:g} to {high:g}")


def extent_of(disparity: FloatImage) -> tuple[float, float]:
    """Return the (far, near) end of the finite values of a map (H, W); of a flat map, a span around its value.

    Raises InputError if no value is finite.
    """
    step = max(1, disparity.size // 1_000_000)
    values = disparity.reshape(-1)[::step]
    known = values[np.isfinite(values)]
    if not known.size:
        known = disparity[np.isfinite(disparity)]
    if not known.size:
        raise InputError("editing depth: no disparity is known; give another map")
    low, high = (float(end) for end in np.percentile(known.astype(np.float64), EXTENT_PERCENTILES))
    if not isclose(low, high, rel_tol=1e-6):
        return low, high
    # A flat map can be painted on: a hundredth of its width counts as its range.
    return low - 0.005 * disparity.shape[1], low + 0.005 * disparity.shape[1]


def apply_tone(disparity: FloatImage, edits: DepthEdits, extent: tuple[float, float] | None = None) -> FloatImage:
    """Return the map (H, W) float32 after inversion, clips and gamma, without strokes; the map itself if none is set.

    extent: `extent_of` the map, computed if None. Values that are not finite become the far end; values beyond the
    extent stay beyond it unless they are clipped.
    """
    if edits.tone == UNEDITED and np.isfinite(disparity).all():
        return np.asarray(disparity, np.float32)
    low, high = extent or extent_of(disparity)
    values = np.where(np.isfinite(disparity), disparity, low)
    share = (values.astype(np.float64) - low) / (high - low)
    limit = np.finfo(np.float32).max
    return np.clip(low + _bend_curve(share, edits) * (high - low), -limit, limit).astype(np.float32)


def tone_curve(share: float, edits: DepthEdits) -> float:
    """Return the value to which `apply_tone` moves a value, both as shares of the extent (0 = far end)."""
    return float(_bend_curve(np.float64(share), edits))


def invert_tone_curve(share: float, edits: DepthEdits) -> float:
    """Return the inverse of `tone_curve` without inversion and clips."""
    return share ** (1 / edits.gamma) if 0 < share < 1 else share if share <= 0 else 1 + (share - 1) / edits.gamma


def levels_of(disparity: FloatImage, extent: tuple[float, float] | None = None) -> Levels:
    """Return the histogram of a map (H, W) over an extent, by default its own; values beyond count at the ends.

    Raises InputError if no value is finite.
    """
    low, high = extent or extent_of(disparity)
    known = disparity[np.isfinite(disparity)][:: max(1, disparity.size // 1_000_000)]
    counts, _ = np.histogram(np.clip(known, low, high), HISTOGRAM_BINS, (low, high))
    return Levels(low, high, tuple(counts.tolist()))


def _bend_curve(share: np.ndarray | np.float64, edits: DepthEdits) -> np.ndarray:
    """Return shares after inversion, clips and gamma; beyond 0 and 1 the curve continues straight."""
    share = 1 - share if edits.is_inverted else share
    low = -inf if edits.far_clip == 0 else edits.far_clip
    high = inf if edits.near_clip == 1 else edits.near_clip
    share = np.clip(share, low, high)
    inside = np.clip(share, 0.0, 1.0) ** edits.gamma
    return np.where(share > 1, 1 + edits.gamma * (share - 1), np.where(share < 0, share, inside))
