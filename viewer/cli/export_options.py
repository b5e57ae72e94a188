"""The kind of an export and its options, for `export` and `batch`."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from iibr_core.depth.editing.edits import TOLERANCE_LIMITS
from iibr_core.exports import kinds
from iibr_core.exports.kinds import EXPORTS
from iibr_core.formats.quilts import DEVICES
from iibr_core.runtime.extras import require_extra
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from viewer.cli.option_records import flag, option
from viewer.cli.options import LensOptions, Pair, name_in, pair_from_text, require_not_given, size_from_text

MAX_BUDGET_BYTES = 10**9
To = Annotated[str, option(f"{', '.join(EXPORTS)}.", "KIND", "", "--to", parser=name_in(EXPORTS))]


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


FRAMES_TEXT = "Number of frames of an animation or pictures of a focal stack."
FRAMES_DEFAULT = f"{kinds.DEFAULT_SECONDS:g} s; {defaults_of('frames')}"
SIZE_DEFAULT = f"the photo's; largest width: {defaults_of('max_width_px')}"
SLOWEST, FASTEST = kinds.RATE_LIMITS


@dataclass(frozen=True)
class KindOptions:
    """Options of some kinds of export, None for the defaults of `ExportOptions`."""

    size: Annotated[
        ScreenSize | None, option("Size of each picture in pixels.", "WxH", SIZE_DEFAULT, parser=size_from_text)
    ] = None
    device: Annotated[
        str | None, option(f"Display of a quilt: {', '.join(DEVICES)}.", "NAME", parser=name_in(DEVICES))
    ] = None
    eyes: Annotated[float | None, option("View steps between the two eyes.", "X", "the whole grid", min=0)] = None
    motion: Annotated[kinds.AnimationKind | None, option("Motion of an animation.", None, "circle")] = None
    rack: Annotated[
        tuple[float, float] | None,
        option("Focus disparities of the motion rack.", "FROM TO", "the nearest and the farthest"),
    ] = None
    frames: Annotated[int | None, option(FRAMES_TEXT, "N", FRAMES_DEFAULT, min=1, max=kinds.MAX_FRAMES)] = None
    rate: Annotated[float | None, option("Frames per second.", "X", defaults_of("rate"), min=SLOWEST, max=FASTEST)] = (
        None
    )
    layout: Annotated[kinds.DepthLayout | None, option("Place of the depth beside its picture.", None, "right")] = None
    bits: Annotated[Literal[8, 16] | None, option("Bits per channel of a focal stack.", None, "8")] = None
    budget: Annotated[
        int | None, option("Largest size of a web page, such as 3MB.", "SIZE", "no limit", parser=budget_from_text)
    ] = None
    credit: Annotated[bool, flag("--credit", "Show the photo's title, author and copyright in a web page.")] = False
    target: Annotated[
        kinds.Target | None, option("Device for a web page: headset takes a finer grid.", None, "any browser", "--for")
    ] = None

    at: Annotated[
        Pair | None,
        option("Place of a matte's surface, in pixels from the left and the top.", "X,Y", parser=pair_from_text),
    ] = None
    tolerance: Annotated[
        float | None,
        option(
            "Factor of the contrast at which a matte's surface ends.",
            "X",
            "1",
            min=TOLERANCE_LIMITS[0],
            max=TOLERANCE_LIMITS[1],
        ),
    ] = None
    soft: Annotated[
        float | None,
        option("Disparity over which a depth mask fades at both ends.", "X", "a tenth of the scene's", min=0),
    ] = None

    def finer(self, source: Source) -> Source:
        """Return the source with the grid that the device needs, unless a grid is given."""
        is_open = self.target == "headset" and source.grid is None
        return replace(source, grid=kinds.HEADSET_GRID) if is_open else source

    def options(self, keys: Path | None = None, row: int | None = None, show: bool = False) -> kinds.ExportOptions:
        """Return the options of an export, with those that only single photos have."""
        given = {field.name: getattr(self, field.name) for field in fields(self)} | {"row": row}
        chosen = {name: value for name, value in given.items() if value is not None}
        return kinds.ExportOptions(**chosen, keys=keys, show=show)


KIND_SPECIFIC_OPTIONS = {"keys", "row", "show", *(field.name for field in (*fields(LensOptions), *fields(KindOptions)))}
"""Options that only some kinds support."""
LENS_WORDS = {
    "focus": ("focus_at", "focus_range", "tilt"),
    "aperture": ("f_number", "blades", "roundness", "rotation", "ring", "cat_eye", "mask", "highlights"),
    "defocus": ("aperture", "f_number"),
}
"""Options that come with the focus, with an aperture, and with its width alone."""


def require_kind(context: typer.Context, name: str) -> kinds.ExportKind:
    """Return the kind of an export.

    Raises InputError if options were given that the kind does not support, or if a package that it needs is missing.
    """
    kind = EXPORTS[name]
    lens = (word for part in kind.supports for word in LENS_WORDS.get(part, ()))
    supported = {*kind.supports, *lens, *(("gloss",) if kind.has_colors else ())}
    require_not_given(context, KIND_SPECIFIC_OPTIONS - supported, f"not for --to {name}")
    if kind.needs:
        require_extra("export", *kind.needs)
    return kind
