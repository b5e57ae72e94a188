"""A gloss in files: its TOML file, and the bounds of its numbers. The fields are those of `Gloss`, by name.

Import this module late: msgspec takes 10 to 40 ms, which the window's first frame need not wait for.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, TypedDict

import msgspec
from msgspec import Meta

from iibr_core.formats.files import printable, read_text
from iibr_core.gloss.settings import (
    LIGHT_RADIUS_LIMITS_DEG,
    MAX_STROKE_POINTS,
    MAX_TOLERANCE,
    STROKE_RADIUS_LIMITS,
    Gloss,
)
from iibr_core.types import InputError

MAX_BYTES = 1_000_000
"""Largest size of a gloss file, in bytes."""

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Place = Annotated[float, Meta(ge=-1.0, le=2.0)]
Length = Annotated[float, Meta(ge=-1e6, le=1e6)]
Strength = Annotated[float, Meta(ge=0.0, le=100.0)]
Tolerance = Annotated[float, Meta(ge=0.0, le=MAX_TOLERANCE)]
StrokeRadius = Annotated[float, Meta(ge=STROKE_RADIUS_LIMITS[0], le=STROKE_RADIUS_LIMITS[1])]
LightRadius = Annotated[float, Meta(ge=LIGHT_RADIUS_LIMITS_DEG[0], le=LIGHT_RADIUS_LIMITS_DEG[1])]
Points = Annotated[tuple[tuple[Place, Place], ...], Meta(min_length=1, max_length=MAX_STROKE_POINTS)]


class StrokeBounds(TypedDict, total=False):
    """Bounds of a `GlossStroke`."""

    points: Points
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


def read_gloss(path: Path) -> Gloss:
    """Return the gloss that a file describes. Raises InputError, naming file and field, if it is damaged."""
    text = read_text(path, MAX_BYTES)
    try:
        whole = tomllib.loads(text)
        for unknown in unknown_fields(whole, msgspec.to_builtins(Gloss())):
            raise ValueError(f"there is no setting {unknown}")
        msgspec.convert(whole, GlossBounds)
        return msgspec.convert(whole, Gloss)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).replace("- at `$.", "at `").split())[:120]
        raise InputError(f"{path}: is not a gloss file ({reason}); correct it") from error


def unknown_fields(raw: Any, known: Any, within: str = "") -> Iterator[str]:
    """Yield the names, with dots, of fields that are in the text but not in what was read from it.

    Fields that are false or "" are skipped: earlier versions wrote them for absent values.
    """
    if isinstance(raw, dict) and isinstance(known, dict):
        for name, value in raw.items():
            if name in known:
                yield from unknown_fields(value, known[name], f"{within}{name}.")
            elif value is not False and value != "":
                yield within + printable(" ".join(name.split())[:40])
    elif isinstance(raw, list) and isinstance(known, list | tuple):
        for value, known_value in zip(raw, known):
            yield from unknown_fields(value, known_value, within)
