"""Cost of painting strokes; a file from elsewhere may not ask for too much of it."""

from __future__ import annotations

from iibr_core.depth.editing.edits import Stroke
from iibr_core.gloss.settings import GlossStroke
from iibr_core.types import InputError

MAX_WORK = 30_000.0
"""Most passes over the map, of about 4 ms for a million pixels; 1,000 usual strokes take 6,600."""
STROKE_WORK = 0.1
BRUSH_WORK, SMOOTH_WORK, FILL_WORK, GLOSS_WORK = 6.0, 26.0, 20.0, 20.0
"""Passes of a brush as large as the map, of smoothing a stroke, of filling from a point, of marking gloss."""


def require_bounded(strokes: tuple[Stroke, ...], gloss_strokes: tuple[GlossStroke, ...] = ()) -> None:
    """Raise InputError if painting all strokes takes more than MAX_WORK."""
    work = sum(map(_depth_work, strokes)) + sum(1.0 + GLOSS_WORK * _swept_area(stroke) for stroke in gloss_strokes)
    if work > MAX_WORK:
        count = len(strokes) + len(gloss_strokes)
        raise InputError(f"{count:,} strokes take {work / MAX_WORK:.1f} times as long to paint as a file may ask for")


def _depth_work(stroke: Stroke) -> float:
    if stroke.tool == "fill":
        return FILL_WORK * len(stroke.points)
    return STROKE_WORK + BRUSH_WORK * _swept_area(stroke) + (SMOOTH_WORK if stroke.tool == "smooth" else 0.0)


def _swept_area(stroke: Stroke | GlossStroke) -> float:
    """Return the summed areas of the windows around the parts of the path, as shares of the map."""
    parts = zip((stroke.points[0], *stroke.points), stroke.points)
    around = 2 * stroke.radius
    return sum((abs(x1 - x0) + around) * (abs(y1 - y0) + around) for (x0, y0), (x1, y1) in parts)
