"""A disparity map that follows its edits while they are made: tone, then the strokes of the brush, one on the other."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from iibr_core.depth.editing.edits import (
    DEPTH_TOOLS,
    UNEDITED,
    BrushTool,
    DepthEdits,
    Stroke,
    apply_tone,
    extent_of,
    require_sound,
)
from iibr_core.depth.editing.smoothing import smooth_within_contours, texture_contrast
from iibr_core.depth.editing.stroke_distance import Window, falloff, measure_from
from iibr_core.depth.editing.surface import surface_at
from iibr_core.depth.editing.touched_colors import Guide, guide_of
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage

MAPS_KEPT = 8
"""Of those before the last strokes: so many can be taken back at once."""
SIGNS: dict[BrushTool, float] = {"nearer": 1.0, "farther": -1.0}
MOST = float(np.finfo(np.float32).max)


def apply_edits(photo: FloatImage, disparity: FloatImage, edits: DepthEdits) -> FloatImage:
    """The map with all its edits: (H, W) float32, finite; the map itself where nothing is edited.

    photo: (H, W, 3), sRGB-encoded, guides the strokes. disparity: (H, W), any unit in which larger is closer.
    Raises InputError where the edits are not sound (see `require_sound`) or no disparity is known.
    """
    return DepthCanvas(photo, disparity).apply(edits)


class DepthCanvas:
    """A map that follows its edits: where they only go on, only what is new is worked out.

    `shown` gives the same as `apply_edits`, to the bit, whatever was shown before.
    """

    def __init__(self, photo: FloatImage, disparity: FloatImage) -> None:
        """photo: (H, W, 3), sRGB-encoded; disparity: (H, W). Raises ValueError where the sizes differ."""
        if photo.shape != (*disparity.shape, 3):
            raise ValueError(f"the photo is {photo.shape}, the disparity {disparity.shape}")
        self._photo, self._given = photo, np.asarray(disparity, np.float32)
        self._guide: Guide | None = None
        self._texture: float | None = None
        self._is_known = bool(np.isfinite(self._given).all())
        self._extent: tuple[float, float] | None = None
        self._edits = UNEDITED.tone
        self._toned: FloatImage | None = None
        self._values: FloatImage = self._given
        self._open: _OpenStroke | None = None
        self._trail: list[tuple[int, FloatImage]] = []  # (strokes, map) before the last ones, to go back to

    def apply(self, edits: DepthEdits) -> FloatImage:
        """The map with these edits, (H, W) float32; not to be written to. Raises as `apply_edits` does; what was
        painted until then is kept.
        """
        if edits == UNEDITED and self._is_known:
            return self._given
        require_sound(edits)
        self._extent = self._extent or extent_of(self._given)
        if self._toned is None or self._edits.tone != edits.tone:
            self._toned = apply_tone(self._given, edits, self._extent)
            self._forget(edits)
        self._return_to(edits)
        self._paint_through(edits.strokes[len(self._edits.strokes) : -MAPS_KEPT])
        for stroke in edits.strokes[len(self._edits.strokes) :]:
            raise_if_stopped()
            self._begin(stroke)
        return self._values

    def resume(self, edits: DepthEdits, values: FloatImage) -> None:
        """Go on from the map that these edits made of the same photo and disparity elsewhere."""
        self._extent = self._extent or extent_of(self._given)
        self._toned = apply_tone(self._given, edits, self._extent)
        self._edits, self._values, self._open = edits, values, None
        self._trail = [(len(edits.strokes), values)]

    def renewed(self) -> DepthCanvas:
        """Return a canvas of the same map without any edits."""
        return DepthCanvas(self._photo, self._given)

    def strokes_ahead(self, edits: DepthEdits) -> int:
        """How many strokes `apply` would paint."""
        done, wanted = self._edits.strokes, edits.strokes
        if self._toned is None or self._edits.tone != edits.tone:
            return len(wanted)
        alike = _alike(done, wanted)
        kept = (
            len(done) if alike == len(done) else max((count for count, _ in self._trail if count <= alike), default=0)
        )
        return len(wanted) - kept

    def before_strokes(self, edits: DepthEdits) -> FloatImage:
        """The map without the strokes of these edits: what stays as it is where the brush does not go."""
        if edits.tone == UNEDITED and self._is_known:
            return self._given
        self.apply(edits)
        assert self._toned is not None
        return self._toned

    def _forget(self, edits: DepthEdits) -> None:
        assert self._toned is not None
        self._edits, self._values, self._open = edits.tone, self._toned, None
        self._trail.clear()

    def _return_to(self, edits: DepthEdits) -> None:
        """Keep of what was painted what these strokes begin with, and go on with the last one if it became longer."""
        done, wanted = self._edits.strokes, edits.strokes
        if wanted[: len(done)] == done:
            return
        alike = _alike(done, wanted)
        is_last = self._open is not None and alike == len(done) - 1 < len(wanted)
        if is_last and _goes_on(done[-1], wanted[alike]):
            self._go_on(wanted[alike], first=len(done[-1].points))
            return
        while self._trail and self._trail[-1][0] > alike:
            self._trail.pop()
        if not self._trail:
            self._forget(edits)
            return
        count, self._values = self._trail.pop()
        self._open, self._edits = None, replace(self._edits, strokes=done[:count])

    def _paint_through(self, strokes: tuple[Stroke, ...]) -> None:
        """Paint strokes of which none is taken back by itself: no map between them is kept, so only what they cover is
        worked on.
        """
        if not strokes:
            return
        self._open, self._values = None, self._values.copy()
        under, distance = self._values.copy(), np.ones(self._values.shape, np.float32)
        for stroke in strokes:
            raise_if_stopped()
            covered = self._lay(self._values, stroke, 0, _OpenStroke(under, distance, self._target(stroke, under)))
            for window in covered:
                under[window], distance[window] = self._values[window], 1
            self._edits = replace(self._edits, strokes=(*self._edits.strokes, stroke))

    def _begin(self, stroke: Stroke) -> None:
        under = self._values
        self._trail = [*self._trail, (len(self._edits.strokes), under)][-MAPS_KEPT:]
        self._open = _OpenStroke(under, np.ones(under.shape, np.float32), self._target(stroke, under))
        self._edits = replace(self._edits, strokes=(*self._edits.strokes, stroke))
        self._paint(stroke, first=0)

    def _go_on(self, stroke: Stroke, first: int) -> None:
        self._edits = replace(self._edits, strokes=(*self._edits.strokes[:-1], stroke))
        self._paint(stroke, first)

    def _target(self, stroke: Stroke, under: FloatImage) -> FloatImage | None:
        """The map that a stroke leads to, None where it moves what is there."""
        if stroke.tool == "smooth":
            radius = stroke.radius_px(under.shape[1])
            self._texture = texture_contrast(self._photo) if self._texture is None else self._texture
            return smooth_within_contours(self._photo, under, radius, self._texture)
        if stroke.tool in DEPTH_TOOLS:
            return np.full_like(under, _value_at(under, stroke.taken_from or stroke.points[0]))
        return None

    def _paint(self, stroke: Stroke, first: int) -> None:
        """Lay the stroke on the map, from its point of this index on. Maps handed out before stay as they are."""
        assert self._open is not None
        self._values = self._values.copy()
        self._lay(self._values, stroke, first, self._open)

    def _lay(self, values: FloatImage, stroke: Stroke, first: int, opened: _OpenStroke) -> list[Window]:
        """Lay the stroke on this map, from its point of this index on. Returns the windows that it changed."""
        assert self._extent is not None
        under, distance, target = opened.under, opened.distance, opened.target
        windows: list[Window] = []
        for i in range(first, len(stroke.points)):
            rows, columns = self._reach(stroke, i, opened)
            windows.append((rows, columns))
            if target is None:
                amount = stroke.strength * (self._extent[1] - self._extent[0]) * SIGNS[stroke.tool]
                _move(values, under, distance, rows, columns, amount)
            else:
                _blend(values, under, target, distance, rows, columns, stroke.strength)
        return windows

    def _reach(self, stroke: Stroke, index: int, open_stroke: _OpenStroke) -> Window:
        """Bring the distances up to the stroke's point of this index. Returns the window in which they changed."""
        assert self._extent is not None
        self._guide = guide_of(self._photo) if self._guide is None else self._guide
        if stroke.tool != "fill":
            return measure_from(self._guide, stroke, index, open_stroke.distance)
        if not _value_at(open_stroke.distance, stroke.points[index]) > 0:  # it is filled already
            return slice(0, 0), slice(0, 0)
        surface = surface_at(self._guide, open_stroke.under, stroke, index, self._extent)
        open_stroke.distance[surface] = 0
        height, width = open_stroke.distance.shape
        return slice(0, height), slice(0, width)


@dataclass(frozen=True, eq=False)
class _OpenStroke:
    """The last stroke, which may go on. under: the map without it. distance: of every pixel from it, 1 = out of reach.

    target: the map that it leads to, None where it moves what is there.
    """

    under: FloatImage
    distance: FloatImage
    target: FloatImage | None


def _value_at(values: FloatImage, place: tuple[float, float]) -> float:
    """What lies at a place (x, y), as shares of width and height; at the border where it lies outside."""
    height, width = values.shape
    x, y = (min(max(share, 0.0), 1.0) for share in place)
    return float(values[min(int(y * height), height - 1), min(int(x * width), width - 1)])


def _alike(done: tuple[Stroke, ...], wanted: tuple[Stroke, ...]) -> int:
    """How many strokes both begin with."""
    return next((i for i, (a, b) in enumerate(zip(done, wanted)) if a != b), min(len(done), len(wanted)))


def _goes_on(old: Stroke, new: Stroke) -> bool:
    """Whether a stroke is another one, continued."""
    return replace(new, points=old.points) == old and new.points[: len(old.points)] == old.points


@kernel
def _move(values, under, distance, rows, columns, amount):
    """Lay a stroke that moves by an amount on what was there before, in a window."""
    for y in range(rows.start, rows.stop):
        for x in range(columns.start, columns.stop):
            # In float64, which does not overflow.
            values[y, x] = min(max(under[y, x] + falloff(distance[y, x]) * amount, -MOST), MOST)


@kernel
def _blend(values, under, target, distance, rows, columns, strength):
    """Lay a stroke that leads to a target on what was there before, in a window."""
    for y in range(rows.start, rows.stop):
        for x in range(columns.start, columns.stop):
            before = np.float64(under[y, x])
            change = strength * (np.float64(target[y, x]) - before)
            values[y, x] = min(max(before + falloff(distance[y, x]) * change, -MOST), MOST)
