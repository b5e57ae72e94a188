"""A disparity map that follows its edits while they are made: tone, then one brush stroke over the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.brush import Window, falloff, lower_distances, smooth_within_contours
from iibr_core.depth.editing.bucket import surface_at
from iibr_core.depth.editing.edits import DEPTH_TOOLS, SURFACE_TOOLS, DepthEdits, Stroke, apply_tone, extent_of
from iibr_core.depth.editing.selected import feathered, flooded, patched
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage

MAPS_KEPT = 8
"""Number of strokes that are undone without painting the earlier ones again."""


def apply_edits(photo: FloatImage, disparity: FloatImage, edits: DepthEdits) -> FloatImage:
    """Return the map with all its edits, (H, W) float32, finite; the map itself if nothing is edited.

    photo: (H, W, 3), sRGB-encoded, guides the strokes. disparity: (H, W), any unit in which larger is closer. Raises
    InputError if no disparity is known.
    """
    return DepthCanvas(photo, disparity).apply(edits)


class DepthCanvas:
    """A map that follows its edits: only strokes that are new or became longer are painted."""

    def __init__(self, photo: FloatImage, disparity: FloatImage) -> None:
        """photo: (H, W, 3), sRGB-encoded; disparity: (H, W). Raises ValueError if the sizes differ."""
        if photo.shape != (*disparity.shape, 3):
            raise ValueError(f"the photo is {photo.shape}, the disparity {disparity.shape}")
        self._photo, self._given = photo, np.asarray(disparity, np.float32)
        self._tone: DepthEdits | None = None
        self._maps: list[tuple[tuple[Stroke, ...], FloatImage]] = []  # after the last strokes, oldest first
        self._last: _PaintedStroke | None = None

    def apply(self, edits: DepthEdits) -> FloatImage:
        """Return the map with these edits, (H, W) float32, not to be written to.

        Raises InputError if no disparity is known, and Cancelled between strokes; finished strokes stay painted.
        """
        if self._tone != edits.tone:
            self.resume(edits.tone, self.without_strokes(edits))
        while self._maps and not _starts_with(edits.strokes, self._maps[-1][0]):
            self._maps.pop()
        if not self._maps:
            self._maps = [((), self.without_strokes(edits))]
        for stroke in edits.strokes[len(self._maps[-1][0]) :]:
            raise_if_stopped()
            self._paint(stroke)
        return self._maps[-1][1]

    def resume(self, edits: DepthEdits, values: FloatImage) -> None:
        """Continue from the map that another canvas of the same photo and disparity made of these edits."""
        self._tone, self._maps, self._last = edits.tone, [(edits.strokes, values)], None

    def renewed(self) -> DepthCanvas:
        """Return a canvas of the same map without any edits."""
        return DepthCanvas(self._photo, self._given)

    def strokes_ahead(self, edits: DepthEdits) -> int:
        """Return the number of strokes that `apply` would paint."""
        counts = [len(strokes) for strokes, _ in self._maps if _starts_with(edits.strokes, strokes)]
        return len(edits.strokes) - (max(counts, default=0) if self._tone == edits.tone else 0)

    def without_strokes(self, edits: DepthEdits) -> FloatImage:
        """Return the map with the tone of these edits."""
        return apply_tone(self._given, edits, self._extent)

    @cached_property
    def _extent(self) -> tuple[float, float]:
        return extent_of(self._given)

    def _paint(self, stroke: Stroke) -> None:
        """Paint a stroke on the last map; only its new points if it continues the last painted stroke."""
        strokes, under = self._maps[-1]
        last = self._last
        if last is None or last.under is not under or not _continues(last.stroke, stroke):
            distance = np.ones(under.shape, np.float32)
            last = _PaintedStroke(replace(stroke, points=()), under, self._change(stroke, under), distance, under)
        values = last.values.copy()
        limit = np.finfo(np.float32).max
        for i in range(len(last.stroke.points), len(stroke.points)):
            part = self._reach(stroke, i, last)
            change = falloff(last.distance[part]) * last.change[part]
            values[part] = np.clip(under[part] + change, -limit, limit)
        self._last = replace(last, stroke=stroke, values=values)
        self._maps = [*self._maps, ((*strokes, stroke), values)][-MAPS_KEPT - 1 :]

    def _change(self, stroke: Stroke, under: FloatImage) -> NDArray[np.float64]:
        """Return the change (H, W) that the middle of a stroke makes; float64, which does not overflow."""
        target: FloatImage | np.float32
        if stroke.tool == "smooth":
            target = smooth_within_contours(self._photo, under, stroke.radius_px(under.shape[1]))
        elif stroke.tool in DEPTH_TOOLS:
            target = _value_at(under, stroke.taken_from or stroke.points[0])
        else:
            span = self._extent[1] - self._extent[0]
            is_nearer = stroke.tool in ("nearer", "forward")
            return np.broadcast_to(stroke.strength * (span if is_nearer else -span), under.shape)
        return np.asarray(stroke.strength * np.subtract(target, under, dtype=np.float64))

    def _reach(self, stroke: Stroke, index: int, last: _PaintedStroke) -> Window:
        """Update the distances for the stroke's point of this index. Return the window in which they changed."""
        if stroke.tool not in SURFACE_TOOLS:
            return lower_distances(self._photo, stroke, index, last.distance)
        if stroke.tool not in DEPTH_TOOLS:
            mask = patched(self._photo, flooded(self._photo, last.under, stroke, self._extent), stroke)
            last.distance[:] = feathered(last.under, mask, stroke, self._extent)
            return slice(None), slice(None)
        if _value_at(last.distance, stroke.points[index]) == 0:  # filled already
            return slice(0), slice(0)
        last.distance[surface_at(self._photo, last.under, stroke, index, self._extent)] = 0
        return slice(None), slice(None)


@dataclass(frozen=True, eq=False)
class _PaintedStroke:
    """The last stroke, which may become longer, the map `under` it and the `values` with it.

    change: see `DepthCanvas._change`. distance: of every pixel from the stroke, see `lower_distances`.
    """

    stroke: Stroke
    under: FloatImage
    change: NDArray[np.float64]
    distance: FloatImage
    values: FloatImage


def _value_at(values: FloatImage, place: tuple[float, float]) -> np.float32:
    """Return the value at a place (x, y) in shares of width and height, or at the border nearest to it."""
    height, width = values.shape
    x, y = (min(max(share, 0.0), 1.0) for share in place)
    return np.float32(values[min(int(y * height), height - 1), min(int(x * width), width - 1)])


def _starts_with(strokes: tuple[Stroke, ...], first: tuple[Stroke, ...]) -> bool:
    return strokes[: len(first)] == first


def _continues(old: Stroke, new: Stroke) -> bool:
    """Return whether a stroke is another stroke with more points."""
    return replace(new, points=old.points) == old and new.points[: len(old.points)] == old.points
