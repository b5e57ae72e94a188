"""Bounds of the numbers of a gloss in files, for `msgspec.convert`.

Import this module late, as `saved_settings`: msgspec costs the window time before its first frame.
"""

from __future__ import annotations

from typing import Annotated, TypedDict

from msgspec import Meta

from iibr_core.gloss.settings import LIGHT_RADIUS_LIMITS_DEG, MAX_STROKE_POINTS, MAX_TOLERANCE, STROKE_RADIUS_LIMITS

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Place = Annotated[float, Meta(ge=-1.0, le=2.0)]
Length = Annotated[float, Meta(ge=-1e6, le=1e6)]
Strength = Annotated[float, Meta(ge=0.0, le=100.0)]
Tolerance = Annotated[float, Meta(ge=0.0, le=MAX_TOLERANCE)]
StrokeRadius = Annotated[float, Meta(ge=STROKE_RADIUS_LIMITS[0], le=STROKE_RADIUS_LIMITS[1])]
LightRadius = Annotated[float, Meta(ge=LIGHT_RADIUS_LIMITS_DEG[0], le=LIGHT_RADIUS_LIMITS_DEG[1])]
Path = Annotated[tuple[tuple[Place, Place], ...], Meta(min_length=1, max_length=MAX_STROKE_POINTS)]


class StrokeBounds(TypedDict, total=False):
    """Bounds of a `GlossStroke`."""

    points: Path
    radius: StrokeRadius


class SurfaceBounds(TypedDict, total=False):
    """Bounds of a `GlossSurface`."""

    farthest: Share
    nearest: Share
    color: tuple[Share, Share, Share] | None
    tolerance: Tolerance
    strokes: tuple[StrokeBounds, ...]


class LightBounds(TypedDict, total=False):
    """Bounds of a `GlossLight`."""

    direction: tuple[Length, Length, Length]
    color: tuple[Strength, Strength, Strength]
    radius_deg: LightRadius


class GlossBounds(TypedDict, total=False):
    """Bounds of a `Gloss`."""

    surface: SurfaceBounds
    roughness: Share
    reflectance: Share
    light: LightBounds
