"""What the options of `export` and `batch` say: what is written, and what some kinds of export are told."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.exports.kinds import EXPORTS, ExportKind, export_kind
from iibr_core.exports.options import ANIMATIONS, AnimationKind, ExportOptions
from iibr_core.exports.settings import MOST_FRAMES, RATE_LIMITS, USUAL_SECONDS
from iibr_core.formats.quilts import DEVICES
from iibr_core.runtime.extras import require_extra
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.cli.lens_options import LensOptions
from viewer.cli.shared_options import given_options, not_negative_from_text, size_from_text


def kind_from_text(text: str) -> ExportKind:
    """What to export, by name. Raises BadParameter."""
    try:
        return export_kind(text)
    except InputError as error:
        raise typer.BadParameter(str(error)) from error


def device_from_text(text: str) -> str:
    """A light-field display, by name. Raises BadParameter."""
    if text not in DEVICES:
        raise typer.BadParameter(f"{text!r} is not a known display: give {', '.join(DEVICES)}")
    return text


def motion_from_text(text: str) -> AnimationKind:
    """What moves in an animation, by name. Raises BadParameter."""
    for motion in ANIMATIONS:
        if text == motion:
            return motion
    raise typer.BadParameter(f"{text!r} is no motion: give {', '.join(ANIMATIONS)}")


def rate_from_text(text: str) -> float:
    """Frames a second. Raises BadParameter."""
    rate = not_negative_from_text(text)
    least, most = RATE_LIMITS
    if not least <= rate <= most:
        raise typer.BadParameter(f"{text!r} is no rate: give {least:g} to {most:g} frames a second")
    return rate


def budget_from_text(text: str) -> int:
    """Bytes of a file from "3MB", "500kB" or "1000000"; K and M are powers of ten. Raises BadParameter."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?([kM]?)B?", text.strip(), re.IGNORECASE)
    budget = float(match[1]) * {"": 1, "K": 1e3, "M": 1e6}[match[2].upper()] if match else 0.0
    if not 1 <= budget <= MOST_BUDGET:
        raise typer.BadParameter(f"{text!r} is no size of a file: give bytes, or as 500kB or 3MB")
    return int(budget)


MOST_BUDGET = 10**9
To = Annotated[
    ExportKind, typer.Option("--to", parser=kind_from_text, metavar="KIND", help=f"One of {', '.join(EXPORTS)}.")
]


def usual_of(field: str) -> str:
    """The numbers that kinds have where nothing is said: "mp4, webm 30, gif 15"."""
    numbers: dict[float, list[str]] = {}
    for name, kind in EXPORTS.items():
        if getattr(kind, field):
            numbers.setdefault(getattr(kind, field), []).append(name)
    return "; ".join(f"{', '.join(names)} {number:g}" for number, names in numbers.items())


USUAL_SIZE = f"the photo's; at most {usual_of('most_width_px')} wide"
USUAL_FRAMES = f"{USUAL_SECONDS:g} s of them; {usual_of('frames')}"


@dataclass(frozen=True)
class KindOptions:
    """As `ExportOptions` has them."""

    size: Annotated[
        ScreenSize | None,
        typer.Option(parser=size_from_text, metavar="WxH", help="Of each picture.", show_default=USUAL_SIZE),
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
        typer.Option(parser=motion_from_text, metavar="|".join(ANIMATIONS), help="What moves.", show_default="circle"),
    ] = None
    frames: Annotated[
        int | None,
        typer.Option(
            min=1, max=MOST_FRAMES, help="Of an animation, or pictures of a stack.", show_default=USUAL_FRAMES
        ),
    ] = None
    rate: Annotated[
        float | None,
        typer.Option(parser=rate_from_text, metavar="X", help="Frames a second.", show_default=usual_of("rate")),
    ] = None

    budget: Annotated[
        int | None,
        typer.Option(
            parser=budget_from_text, metavar="SIZE", help="Of a page at most, as 3MB.", show_default="what looks alike"
        ),
    ] = None
    credit: Annotated[bool, typer.Option("--credit", help="Name the photo's title, author and rights in a page.")] = (
        False
    )
    stills: Annotated[
        bool, typer.Option("--stills", help="A page for Safari too: views a file each, several times as large.")
    ] = False

    def options(self, keys: Path | None = None, row: int | None = None, show: bool = False) -> ExportOptions:
        """With what is said of a single photo."""
        told = {field.name: getattr(self, field.name) for field in fields(self)}
        return ExportOptions(**told, keys=keys, row=row, show=show)


HEEDED_BY_SOME = {"keys", "row", "show", *(field.name for field in (*fields(LensOptions), *fields(KindOptions)))}
"""Options that some kinds heed and others do not."""


def _what_for(option: tuple[str, str]) -> str:
    """Of an option (as it is typed, and its name among those that kinds heed): which kinds it is for."""
    typed, name = option
    kinds = [kind for kind, about in EXPORTS.items() if name in heeded_by(about)]
    if 2 * len(kinds) < len(EXPORTS):
        return f"{typed} is for {', '.join(kinds)}"
    return f"{typed} is for all but {', '.join(kind for kind in EXPORTS if kind not in kinds)}"


def heeded_by(kind: ExportKind) -> set[str]:
    """Names of the options about exports and the lens that mean something to it."""
    return {*kind.supports, "gloss"} if kind.has_colors else set(kind.supports)


def require_kind(context: typer.Context, kind: ExportKind) -> None:
    """Raise InputError for options given that this kind would not heed, and where packages are missing for it."""
    given = (given_options(context) & HEEDED_BY_SOME) - heeded_by(kind)
    if given:
        options = sorted((each.opts[0], each.name or "") for each in context.command.params if each.name in given)
        name = next(name for name, known in EXPORTS.items() if known is kind)
        raise InputError(f"not for --to {name}: {'; '.join(map(_what_for, options))}")
    if kind.needs:
        require_extra("export", *kind.needs)
