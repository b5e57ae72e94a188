"""The values of command-line options: from text, with errors that say what would be right."""

from __future__ import annotations

import math
import re
from typing import NamedTuple, get_args

import typer

from iibr_core.types import GridShape, Quality, ViewOffset

MAX_GRID = 99
_UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}


class Size(NamedTuple):
    """Of an image, in pixels."""

    width: int
    height: int


def grid_from_text(text: str) -> GridShape:
    """A grid of views: "9" is 9x9, "3x9" is 3 rows of 9. Raises BadParameter."""
    match = re.fullmatch(r"(\d+)(?:x(\d+))?", text.strip())
    grid = GridShape(int(match[1]), int(match[2] or match[1])) if match else GridShape(0, 0)
    if not (1 <= grid.rows <= MAX_GRID and 1 <= grid.columns <= MAX_GRID):
        raise typer.BadParameter(f"{text!r} is no grid of views: give 1 to {MAX_GRID}, as 9 or 3x9")
    return grid


def size_from_text(text: str) -> Size:
    """A size from "1280x800". Raises BadParameter."""
    match = re.fullmatch(r"(\d+)x(\d+)", text.strip())
    size = Size(int(match[1]), int(match[2])) if match else Size(0, 0)
    if not all(1 <= side <= 16384 for side in size):
        raise typer.BadParameter(f"{text!r} is no size in pixels: give width x height, as 1280x800")
    return size


def view_from_text(text: str) -> ViewOffset:
    """A view offset from "S,T": steps to the right, then down. Raises BadParameter."""
    parts = text.split(",")
    try:
        s, t = (finite_from_text(part) for part in parts)
    except (ValueError, typer.BadParameter):
        raise typer.BadParameter(f"{text!r} is no viewpoint: give S,T in view steps, as 2,-1.5") from None
    return ViewOffset(t, s)


def quality_from_text(text: str) -> Quality:
    """Where the ray transformer runs, by name. Raises BadParameter."""
    qualities: tuple[Quality, ...] = get_args(Quality)
    for quality in qualities:
        if text == quality:
            return quality
    raise typer.BadParameter(f"{text!r} is no quality: give {', '.join(qualities[:-1])} or {qualities[-1]}")


def finite_from_text(text: str) -> float:
    """A finite number. Raises BadParameter."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise typer.BadParameter(f"{text!r} is no finite number")
    return value


def given_options(context: typer.Context) -> set[str]:
    """Names of the options that were given rather than left at their defaults, as fields of `Source` where they are."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    names = {name for name, source in sources.items() if source is not None and source.name != "DEFAULT"}
    return names | {"memory_bytes"} if "memory" in names else names


def memory_from_text(text: str) -> int:
    """Bytes from "2G", "500M" or "1000000". Raises BadParameter."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([KMGT]?)(?:i?B)?", text.strip(), re.IGNORECASE)
    memory = int(float(match[1]) * _UNITS[match[2].upper()]) if match else 0
    if memory < 1:
        raise typer.BadParameter(f"{text!r} is no amount of memory: give bytes, or as 500M or 2G")
    return memory
