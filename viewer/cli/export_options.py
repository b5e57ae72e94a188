"""The kind of an export and its options, for `export` and `batch`."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Literal

import typer

from iibr_core.exports.kinds import (
    DEFAULT_SECONDS,
    EXPORTS,
    MAX_FRAMES,
    RATE_LIMITS,
    AnimationKind,
    DepthLayout,
    ExportKind,
    ExportOptions,
)
from iibr_core.formats.quilts import DEVICES
from iibr_core.runtime.extras import require_extra
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.cli.lens_options import LensOptions
from viewer.cli.options import given_options, name_in, size_from_text, words_of_options

MAX_BUDGET_BYTES = 10**9
To = Annotated[str, typer.Option("--to", parser=name_in(EXPORTS), metavar="KIND", help=f"{', '.join(EXPORTS)}.")]


def budget_from_text(text: str) -> int:
    """Return the bytes that "3MB", "500kB" or "1000000" stand for; k and M are powers of ten. Raises BadParameter."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?([kM]?)B?", text.strip(), re.IGNORECASE)
    budget = float(match[1]) * {"": 1, "K": 1e3, "M": 1e6}[match[2].upper()] if match else 0.0
    if not 1 <= budget <= MAX_BUDGET_BYTES:
        raise typer.BadParameter(f"{text!r} is not the size of a file: give bytes, or such as 500kB or 3MB")
    return int(budget)


def defaults_of(field: str) -> str:
    """Return the default numbers of the kinds as text: "mp4, webm 30; gif 15"."""
    numbers: dict[float, list[str]] = {}
    for name, kind in EXPORTS.items():
        if getattr(kind, field):
            numbers.setdefault(getattr(kind, field), []).append(name)
    return "; ".join(f"{', '.join(names)} {number:g}" for number, names in numbers.items())


@dataclass(frozen=True)
class KindOptions:
    """Options of some kinds of export, None for the defaults of `ExportOptions`."""

    size: Annotated[
        ScreenSize | None,
        typer.Option(
            parser=size_from_text,
            metavar="WxH",
            help="Size of each picture in pixels.",
            show_default=f"the photo's; at most {defaults_of('max_width_px')} wide",
        ),
    ] = None
    device: Annotated[
        str | None,
        typer.Option(parser=name_in(DEVICES), metavar="NAME", help=f"Display of a quilt: {', '.join(DEVICES)}."),
    ] = None
    eyes: Annotated[
        float | None,
        typer.Option(min=0, metavar="X", help="View steps between the two eyes.", show_default="the whole grid"),
    ] = None
    motion: Annotated[AnimationKind | None, typer.Option(help="Motion of an animation.", show_default="circle")] = None
    rack: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="FROM TO", help="Focus disparities of the motion rack.", show_default="the nearest and the farthest"
        ),
    ] = None
    frames: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=MAX_FRAMES,
            metavar="N",
            help="Number of frames of an animation or pictures of a focal stack.",
            show_default=f"{DEFAULT_SECONDS:g} s; {defaults_of('frames')}",
        ),
    ] = None
    rate: Annotated[
        float | None,
        typer.Option(
            min=RATE_LIMITS[0],
            max=RATE_LIMITS[1],
            metavar="X",
            help="Frames per second.",
            show_default=defaults_of("rate"),
        ),
    ] = None
    layout: Annotated[
        DepthLayout | None, typer.Option(help="Place of the depth beside its picture.", show_default="right")
    ] = None
    bits: Annotated[
        Literal[8, 16] | None, typer.Option(help="Bits per channel of a focal stack.", show_default="8")
    ] = None
    budget: Annotated[
        int | None,
        typer.Option(
            parser=budget_from_text,
            metavar="SIZE",
            help="Largest size of a web page, such as 3MB.",
            show_default="no limit",
        ),
    ] = None
    credit: Annotated[
        bool, typer.Option("--credit", help="Show the photo's title, author and copyright in a web page.")
    ] = False
    stills: Annotated[
        bool, typer.Option("--stills", help="Write a web page for Safari, too; it is several times as large.")
    ] = False

    def options(self, keys: Path | None = None, row: int | None = None, show: bool = False) -> ExportOptions:
        """Return the options of an export, with those that only single photos have."""
        given = {field.name: getattr(self, field.name) for field in fields(self)} | {"row": row}
        chosen = {name: value for name, value in given.items() if value is not None}
        return ExportOptions(**chosen, keys=keys, show=show)


KIND_SPECIFIC_OPTIONS = {"keys", "row", "show", *(field.name for field in (*fields(LensOptions), *fields(KindOptions)))}
"""Options that only some kinds support."""


def require_kind(context: typer.Context, name: str) -> ExportKind:
    """Return the kind of an export.

    Raises InputError if options were given that the kind does not support, or if a package that it needs is missing.
    """
    kind = EXPORTS[name]
    supported = {*kind.supports, *(("gloss",) if kind.has_colors else ())}
    unsupported = (given_options(context) & KIND_SPECIFIC_OPTIONS) - supported
    if unsupported:
        raise InputError(f"{words_of_options(context, unsupported)}: not for --to {name}; leave it out")
    if kind.needs:
        require_extra("export", *kind.needs)
    return kind
