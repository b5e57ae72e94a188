"""The kind of an export and its options, for `export` and `batch`."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.exports.kinds import (
    ANIMATIONS,
    DEFAULT_SECONDS,
    DEPTH_LAYOUTS,
    EXPORTS,
    MAX_FRAMES,
    RATE_LIMITS,
    STACK_BITS,
    AnimationKind,
    DepthLayout,
    ExportKind,
    ExportOptions,
    export_kind,
)
from iibr_core.formats.quilts import DEVICES
from iibr_core.runtime.extras import require_extra
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.cli.lens_options import LensOptions
from viewer.cli.shared_options import given_options, not_negative_from_text, size_from_text


def kind_from_text(text: str) -> ExportKind:
    """Return the kind of this name. Raises BadParameter for an unknown name."""
    try:
        return export_kind(text)
    except InputError as error:
        raise typer.BadParameter(str(error)) from error


def device_from_text(text: str) -> str:
    """Return the name of a light-field display. Raises BadParameter for an unknown name."""
    if text not in DEVICES:
        raise typer.BadParameter(f"{text!r} is not a known display: give {', '.join(DEVICES)}")
    return text


def motion_from_text(text: str) -> AnimationKind:
    """Return the motion of this name. Raises BadParameter for an unknown name."""
    for motion in ANIMATIONS:
        if text == motion:
            return motion
    raise typer.BadParameter(f"{text!r} is no motion: give {', '.join(ANIMATIONS)}")


def layout_from_text(text: str) -> DepthLayout:
    """Return the place of a depth map beside its picture. Raises BadParameter for an unknown name."""
    for layout in DEPTH_LAYOUTS:
        if text == layout:
            return layout
    raise typer.BadParameter(f"{text!r} is no place of the depth: give {', '.join(DEPTH_LAYOUTS)}")


def bits_from_text(text: str) -> int:
    """Return the bits a channel of the pictures of a stack. Raises BadParameter for other numbers."""
    for bits in STACK_BITS:
        if text == str(bits):
            return bits
    raise typer.BadParameter(f"{text!r} bits: give {' or '.join(map(str, STACK_BITS))}")


def rate_from_text(text: str) -> float:
    """Return a frame rate, frames a second. Raises BadParameter outside RATE_LIMITS."""
    rate = not_negative_from_text(text)
    lowest, highest = RATE_LIMITS
    if not lowest <= rate <= highest:
        raise typer.BadParameter(f"{text!r} is no rate: give {lowest:g} to {highest:g} frames a second")
    return rate


def budget_from_text(text: str) -> int:
    """Return the bytes that "3MB", "500kB" or "1000000" stand for; k and M are powers of ten. Raises BadParameter."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?([kM]?)B?", text.strip(), re.IGNORECASE)
    budget = float(match[1]) * {"": 1, "K": 1e3, "M": 1e6}[match[2].upper()] if match else 0.0
    if not 1 <= budget <= MAX_BUDGET_BYTES:
        raise typer.BadParameter(f"{text!r} is no size of a file: give bytes, or as 500kB or 3MB")
    return int(budget)


MAX_BUDGET_BYTES = 10**9
To = Annotated[
    ExportKind, typer.Option("--to", parser=kind_from_text, metavar="KIND", help=f"One of {', '.join(EXPORTS)}.")
]


def defaults_of(field: str) -> str:
    """Return the default numbers of the kinds as text: "mp4, webm 30; gif 15"."""
    numbers: dict[float, list[str]] = {}
    for name, kind in EXPORTS.items():
        if getattr(kind, field):
            numbers.setdefault(getattr(kind, field), []).append(name)
    return "; ".join(f"{', '.join(names)} {number:g}" for number, names in numbers.items())


DEFAULT_SIZE_TEXT = f"the photo's; at most {defaults_of('max_width_px')} wide"
DEFAULT_FRAMES_TEXT = f"{DEFAULT_SECONDS:g} s of them; {defaults_of('frames')}"


@dataclass(frozen=True)
class KindOptions:
    """Options of some kinds of export, None for the defaults of `ExportOptions`."""

    size: Annotated[
        ScreenSize | None,
        typer.Option(
            parser=size_from_text, metavar="WxH", help="Size of each picture in pixels.", show_default=DEFAULT_SIZE_TEXT
        ),
    ] = None
    device: Annotated[
        str | None,
        typer.Option(
            parser=device_from_text, metavar="NAME", help=f"Display to make a quilt for: {', '.join(DEVICES)}."
        ),
    ] = None
    eyes: Annotated[
        float | None,
        typer.Option(
            parser=not_negative_from_text, metavar="X", help="View steps between two eyes.", show_default="all the grid"
        ),
    ] = None
    motion: Annotated[
        AnimationKind | None,
        typer.Option(
            parser=motion_from_text, metavar="|".join(ANIMATIONS), help="Motion of an animation.", show_default="circle"
        ),
    ] = None
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
            help="Number of frames of an animation or pictures of a focal stack.",
            show_default=DEFAULT_FRAMES_TEXT,
        ),
    ] = None
    rate: Annotated[
        float | None,
        typer.Option(parser=rate_from_text, metavar="X", help="Frames a second.", show_default=defaults_of("rate")),
    ] = None
    layout: Annotated[
        DepthLayout | None,
        typer.Option(
            parser=layout_from_text,
            metavar="|".join(DEPTH_LAYOUTS),
            help="Place of the depth beside its picture.",
            show_default="right",
        ),
    ] = None
    bits: Annotated[
        int | None,
        typer.Option(parser=bits_from_text, metavar="8|16", help="Bits a channel of a focal stack.", show_default="8"),
    ] = None
    budget: Annotated[
        int | None,
        typer.Option(
            parser=budget_from_text,
            metavar="SIZE",
            help="Maximum size of a web page, such as 3MB.",
            show_default="no limit",
        ),
    ] = None
    credit: Annotated[bool, typer.Option("--credit", help="Name the photo's title, author and rights in a page.")] = (
        False
    )
    stills: Annotated[
        bool, typer.Option("--stills", help="Write a page that Safari can show, too; it is several times as large.")
    ] = False

    def options(self, keys: Path | None = None, row: int | None = None, show: bool = False) -> ExportOptions:
        """Return the options of an export, with those that only single photos have."""
        given = {field.name: getattr(self, field.name) for field in fields(self)} | {"row": row}
        chosen = {name: value for name, value in given.items() if value is not None}
        return ExportOptions(**chosen, keys=keys, show=show)


KIND_SPECIFIC_OPTIONS = {"keys", "row", "show", *(field.name for field in (*fields(LensOptions), *fields(KindOptions)))}
"""Options that only some kinds support."""


def _kinds_with(option: str, name: str) -> str:
    """Return which kinds support an option. option: as the user types it; name: as the kinds list it."""
    kinds = [kind for kind, about in EXPORTS.items() if name in supported_by(about)]
    if 2 * len(kinds) < len(EXPORTS):
        return f"{option} is for {', '.join(kinds)}"
    return f"{option} is for all but {', '.join(kind for kind in EXPORTS if kind not in kinds)}"


def supported_by(kind: ExportKind) -> set[str]:
    """Return the names of the options of exports and the lens that a kind supports."""
    return {*kind.supports, "gloss"} if kind.has_colors else set(kind.supports)


def require_kind(context: typer.Context, kind: ExportKind) -> None:
    """Raise InputError for given options that this kind does not support, and if it needs missing packages."""
    given = (given_options(context) & KIND_SPECIFIC_OPTIONS) - supported_by(kind)
    if given:
        options = sorted(
            (option.opts[0], option.name or "") for option in context.command.params if option.name in given
        )
        name = next(name for name, known in EXPORTS.items() if known is kind)
        raise InputError(f"not for --to {name}: {'; '.join(_kinds_with(*option) for option in options)}")
    if kind.needs:
        require_extra("export", *kind.needs)
