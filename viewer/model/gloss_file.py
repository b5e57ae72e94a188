"""A gloss in a TOML file; the fields are those of `Gloss`, by name. Limits of its numbers, also for saved settings.

Import this module late: msgspec takes 10 to 40 ms, which the window's first frame need not wait for.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec

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
Limits = Mapping[str, tuple[float, float]]
"""Smallest and largest value of each number, by its name with dots."""
GLOSS_LIMITS: Limits = {
    "roughness": (0.0, 1.0),
    "reflectance": (0.0, 1.0),
    "surface.farthest": (0.0, 1.0),
    "surface.nearest": (0.0, 1.0),
    "surface.color": (0.0, 1.0),
    "surface.tolerance": (0.0, MAX_TOLERANCE),
    "surface.strokes.points": (-1.0, 2.0),
    "surface.strokes.radius": STROKE_RADIUS_LIMITS,
    "light.direction": (-1e6, 1e6),
    "light.color": (0.0, 100.0),
    "light.radius_deg": LIGHT_RADIUS_LIMITS_DEG,
}


def read_gloss(path: Path) -> Gloss:
    """Return the gloss that a file describes. Raises InputError, naming file and field, if it is damaged."""
    text = read_text(path, MAX_BYTES)
    try:
        whole = tomllib.loads(text)
        for unknown in unknown_fields(whole, msgspec.to_builtins(Gloss())):
            raise ValueError(f"there is no setting {unknown}")
        gloss = msgspec.convert(whole, Gloss)
        require_within(gloss, GLOSS_LIMITS)
        require_points(gloss)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not a gloss file ({short_reason(error)}); correct it") from error
    return gloss


def require_within(record: object, limits: Limits) -> None:
    """Raise ValueError, naming the field, if a number of a record or of its parts is out of its limits."""
    for name, value in _numbers_in(msgspec.to_builtins(record)):
        if name in limits and not limits[name][0] <= value <= limits[name][1]:
            raise ValueError("{}: {} is not from {:g} to {:g}".format(name, value, *limits[name]))


def require_points(gloss: Gloss) -> None:
    """Raise ValueError if a stroke has no points or too many."""
    if not all(1 <= len(stroke.points) <= MAX_STROKE_POINTS for stroke in gloss.surface.strokes):
        raise ValueError(f"surface.strokes: a stroke has 1 to {MAX_STROKE_POINTS:,} points")


def short_reason(error: Exception) -> str:
    """Return the message of an error in one short line, with the field that msgspec names."""
    return " ".join(str(error).replace("- at `$.", "at `").split())[:120]


def _numbers_in(value: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """Yield all numbers in dictionaries and lists, with their names; the items of a list have the list's name."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _numbers_in(part, f"{name}.{key}".lstrip("."))
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _numbers_in(part, name)
    elif isinstance(value, int | float):
        yield name, value


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
