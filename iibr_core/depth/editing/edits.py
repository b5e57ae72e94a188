"""What a user makes of a disparity map: inverted, bent by gamma, clipped, painted on. Frozen records, pure functions.

Strengths, clips and places are shares, of the map's range or of the photo's size, so that edits fit any scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import Literal

import numpy as np

from iibr_core.types import FloatImage, InputError

BrushTool = Literal["nearer", "farther", "smooth", "level", "fill"]
BRUSH_TOOLS: tuple[BrushTool, ...] = ("nearer", "farther", "smooth", "level", "fill")
DEPTH_TOOLS: tuple[BrushTool, ...] = ("level", "fill")
"""Those that lead to one depth, taken from some place: along the stroke, or of the surface under it (the bucket)."""

GAMMA_LIMITS = (0.25, 4.0)
RADIUS_LIMITS = (0.002, 0.25)
MOST_POINTS = 10_000
"""Of one stroke."""

EXTENT_PERCENTILES = (0.1, 99.9)
"""The far and the near end of a map's range, without a few wild values."""
FLAT_RANGE_SHARE = 1e-6
"""A range below this share of the values is rounding: the map is flat."""
FLAT_SPAN_WIDTHS = 0.01
"""What counts as the range of a flat map, in photo widths: so that it can be painted on."""
HISTOGRAM_BINS = 64


@dataclass(frozen=True)
class Stroke:
    """One stroke of the brush.

    points: its path, (x, y) as shares of the photo's width and height (0 = left or top border). radius: as a share of
    the photo's width. strength: 0..1; of "nearer" and "farther" the share of the map's range that its middle is moved,
    of "smooth" how far it goes to the smoothed map, of "level" and "fill" to the depth that was before the stroke at
    the place `taken_from`, None: where the stroke begins.
    """

    tool: BrushTool
    points: tuple[tuple[float, float], ...]
    radius: float
    strength: float
    taken_from: tuple[float, float] | None = None

    def radius_px(self, width: int) -> float:
        """The radius in pixels of a map so wide, at least one."""
        return max(self.radius * width, 1.0)


@dataclass(frozen=True)
class DepthEdits:
    """Everything done to a map, in this order: inverted, clipped, bent, painted on. The default changes nothing.

    far_clip, near_clip: shares of the map's range, 0 = far end, 1 = near end; what is farther or nearer is put there, 0
    and 1 clip nothing. gamma: above 1 the far part is spread less, below 1 more.
    """

    is_inverted: bool = False
    far_clip: float = 0.0
    near_clip: float = 1.0
    gamma: float = 1.0
    strokes: tuple[Stroke, ...] = ()

    @property
    def tone(self) -> DepthEdits:
        """The same without strokes."""
        return DepthEdits(self.is_inverted, self.far_clip, self.near_clip, self.gamma)


UNEDITED = DepthEdits()


@dataclass(frozen=True)
class Levels:
    """How the values of a map are spread: from low to high (px per view step) counts of equally wide parts."""

    low: float
    high: float
    counts: tuple[int, ...]


def require_sound(edits: DepthEdits) -> None:
    """Raise InputError where a value of the edits makes no sense: not finite, out of its limits, too many points."""
    checks = [
        ("gamma", edits.gamma, GAMMA_LIMITS),
        ("near clip", edits.near_clip, (edits.far_clip, 1.0)),
        ("far clip", edits.far_clip, (0.0, 1.0)),
    ]
    for stroke in edits.strokes:
        if stroke.tool not in BRUSH_TOOLS or not 1 <= len(stroke.points) <= MOST_POINTS:
            raise InputError(f"depth edits: a stroke {stroke.tool!r} with {len(stroke.points)} points; paint it again")
        checks += [("brush radius", stroke.radius, RADIUS_LIMITS), ("brush strength", stroke.strength, (0.0, 1.0))]
        places = (*stroke.points, *([stroke.taken_from] if stroke.taken_from else []))
        checks += [("place of a stroke", at, (-inf, inf)) for place in places for at in place]
    for name, value, (low, high) in checks:
        if not (isfinite(value) and low <= value <= high):
            raise InputError(f"depth edits: {name} {value} is not from {low:g} to {high:g}")


def extent_of(disparity: FloatImage) -> tuple[float, float]:
    """(far, near) end of a map (H, W) without a few wild values; of a flat one a span about its value.

    What is not finite is left out. Raises InputError where nothing is finite.
    """
    step = max(1, disparity.size // 1_000_000)
    values = disparity.reshape(-1)[::step]
    known = values[np.isfinite(values)]
    if not known.size:
        known = disparity[np.isfinite(disparity)]
    if not known.size:
        raise InputError("editing depth: no disparity is known; give another map")
    low, high = (float(end) for end in np.percentile(known.astype(np.float64), EXTENT_PERCENTILES))
    if high - low > FLAT_RANGE_SHARE * max(abs(low), abs(high)):
        return low, high
    span = FLAT_SPAN_WIDTHS * disparity.shape[1]
    return low - span / 2, low + span / 2


def apply_tone(disparity: FloatImage, edits: DepthEdits, extent: tuple[float, float] | None = None) -> FloatImage:
    """The map (H, W), inverted, clipped and bent; its strokes are left to `canvas.DepthCanvas`. Edits must be sound.

    extent: see `extent_of`, of this map where None. What is not finite is the far end. Values keep their order
    (inverted ones the opposite); those beyond the extent stay beyond it unless they are clipped. Without edits, finite
    maps come back as they are. Returns (H, W) float32.
    """
    low, high = extent or extent_of(disparity)
    values = disparity if np.isfinite(disparity).all() else np.where(np.isfinite(disparity), disparity, low)
    values = np.asarray(values, np.float32)
    if edits.tone == UNEDITED:
        return values
    share = (values.astype(np.float64) - low) / (high - low)
    limit = np.finfo(np.float32).max
    return np.clip(low + _bend_curve(share, edits) * (high - low), -limit, limit).astype(np.float32)


def tone_curve(share: float, edits: DepthEdits) -> float:
    """Where `apply_tone` puts one value, both as shares of the extent (0 = far end)."""
    return float(_bend_curve(np.float64(share), edits))


def invert_tone_curve(share: float, edits: DepthEdits) -> float:
    """The inverse of `tone_curve`, inversion left as it is; exact for what was not clipped."""
    return share ** (1 / edits.gamma) if 0 < share < 1 else share if share <= 0 else 1 + (share - 1) / edits.gamma


def levels_of(disparity: FloatImage) -> Levels:
    """How the values of a map (H, W) are spread over its extent; what is wild counts at the ends.

    Raises InputError where nothing is finite.
    """
    low, high = extent_of(disparity)
    known = disparity[np.isfinite(disparity)][:: max(1, disparity.size // 1_000_000)]
    counts, _ = np.histogram(np.clip(known, low, high), HISTOGRAM_BINS, (low, high))
    return Levels(low, high, tuple(counts.tolist()))


def _bend_curve(share: np.ndarray | np.float64, edits: DepthEdits) -> np.ndarray:
    """Shares after inversion, clips and gamma; beyond 0 and 1 the curve goes on straight."""
    share = 1 - share if edits.is_inverted else share
    low = -inf if edits.far_clip == 0 else edits.far_clip
    high = inf if edits.near_clip == 1 else edits.near_clip
    share = np.clip(share, low, high)
    inside = np.clip(share, 0.0, 1.0) ** edits.gamma
    return np.where(share > 1, 1 + edits.gamma * (share - 1), np.where(share < 0, share, inside))
