"""The options that commands share, and their values from text, with errors that say what would be right."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from iibr_core.depth.choice import DepthChoice, DepthStart
from iibr_core.formats.light_fields.write import WRITERS
from iibr_core.inpainting.registry import INPAINTER_FORMS, require_inpainter
from iibr_core.scenes.inputs import inputs_of
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import (
    GridShape,
    InputError,
    ViewOffset,
)

if TYPE_CHECKING:
    from iibr_core.scenes.scene import Source

MAX_GRID = 99
MOST = 2**62
"""Of bytes and pixels: what adds a few to it still fits into 64 bits."""

OUTPUT_OPTIONS = ("out", "output")
"""Parameters that name what is written. All other paths are read."""
SCREEN_SIZE = ScreenSize(1280, 800)
"""Of the window in pictures, unless another is asked for."""


def grid_from_text(text: str) -> GridShape:
    """A grid of views: "9" is 9x9, "3x9" is 3 rows of 9. Raises BadParameter."""
    match = re.fullmatch(r"(\d{1,4})(?:x(\d{1,4}))?", text.strip())
    grid = GridShape(int(match[1]), int(match[2] or match[1])) if match else GridShape(0, 0)
    if not (1 <= grid.rows <= MAX_GRID and 1 <= grid.columns <= MAX_GRID):
        raise typer.BadParameter(f"{text!r} is no grid of views: give 1 to {MAX_GRID}, as 9 or 3x9")
    return grid


def size_from_text(text: str) -> ScreenSize:
    """A size from "1280x800". Raises BadParameter."""
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text.strip())
    size = ScreenSize(int(match[1]), int(match[2])) if match else ScreenSize(0, 0)
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


def inpainter_from_text(text: str) -> str:
    """A way of inpainting, by name. Raises BadParameter."""
    try:
        require_inpainter(text)
    except InputError as error:
        raise typer.BadParameter(f"{text!r}: {str(error).removeprefix(f'{text}: ')}") from None
    return text


def finite_from_text(text: str) -> float:
    """A finite number. Raises BadParameter."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise typer.BadParameter(f"{text!r} is no finite number")
    return value


def not_negative_from_text(text: str) -> float:
    """A finite number from 0 up. Raises BadParameter."""
    value = finite_from_text(text)
    if value < 0:
        raise typer.BadParameter(f"{text!r} is less than 0")
    return value


def given_options(context: typer.Context) -> set[str]:
    """Names of the options that were given, not left at their defaults; as fields of `SourceText` where they are."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    names = {name for name, source in sources.items() if source is not None and source.name != "DEFAULT"}
    return names


def require_existing(source: Source) -> None:
    """Raise InputError before a window opens, rather than say so in it."""
    for path in (source.path, source.depth.file):
        if path is not None and not Path(path).exists():
            raise InputError(f"{path}: no such file")


def require_model(choice: DepthChoice) -> None:
    """Raise InputError where a depth model is asked for that cannot be used."""
    if choice.asks_for_model:
        from iibr_core.depth.models.catalog import model_to_use

        model_to_use(choice)


def inputs_of_command(context: typer.Context, source: Source | None = None) -> tuple[Path, ...]:
    """What a command reads, and nothing may be written onto: every path that it was given but the one that it writes
    to, what those files name (`reads` of an option's value says it), and what is read to open a source.
    """
    given = [value for name, value in context.params.items() if name not in OUTPUT_OPTIONS]
    named = [path for value in given for path in _paths_in(value)]
    return (*named, *(() if source is None else inputs_of(source)))


def _paths_in(value: object) -> tuple[Path, ...]:
    if isinstance(value, list | tuple):
        return tuple(path for each in value for path in _paths_in(each))
    return (value,) if isinstance(value, Path) else getattr(value, "reads", ())


def require_utf8(*names: object) -> None:
    """Raise InputError for names of files that panels cannot show. What is None counts as a name that they can."""
    for name in map(str, names):
        try:
            name.encode()
        except UnicodeEncodeError:
            raise InputError(
                f"{name}: its name is not UTF-8 here, and cannot be shown: rename it, or set LC_ALL=C.UTF-8"
            ) from None


def depth_start_from_text(text: str) -> DepthStart:
    """Where the search for depth begins, by name. Raises BadParameter."""
    starts: tuple[DepthStart, ...] = get_args(DepthStart)
    for start in starts:
        if text == start:
            return start
    raise typer.BadParameter(f"{text!r} is no source of depth: give {', '.join(starts[:-1])} or {starts[-1]}")


def refine_from_text(text: str) -> bool:
    """Return whether edges are refined: on, off, or a number, of which 0 is off. Raises BadParameter."""
    word = str(text).lower()
    if word in ("on", "off", "true"):
        return word != "off"
    with suppress(typer.BadParameter):
        return finite_from_text(word) != 0
    raise typer.BadParameter(f"{text!r} is no switch: give on or off")


def format_from_text(text: str) -> str:
    """A layout that a light field can be written in, by name. Raises BadParameter."""
    if text not in WRITERS:
        raise typer.BadParameter(f"{text!r} is not a layout that can be written: give {' or '.join(WRITERS)}")
    return text


def number_option(help_text: str) -> Any:
    """An option that is any finite number."""
    return typer.Option(parser=finite_from_text, metavar="X", help=help_text)


PhotoPath = Annotated[
    Path, typer.Argument(help="A photo (JPEG, PNG, TIFF, EXR, WebP, HEIC, AVIF).", show_default=False)
]
SCENE_HELP = "A photo, a stereo photo, or a light field: a folder of views, a quilt, a lenslet image."
ScenePath = Annotated[Path, typer.Argument(help=SCENE_HELP, show_default=False)]
DisparityFile = Annotated[
    Path | None,
    typer.Option(
        "--disparity",
        metavar="FILE",
        help="Depth map. PFM, EXR, NPY: disparity, px per view step; PNG, JPEG, WebP: white is near, unless it shows.",
        show_default=False,
    ),
]
DisparityScale = Annotated[
    float | None, number_option("The map's values times this are disparity, px per view step; -1: black is near.")
]
InvertDepth = Annotated[bool, typer.Option("--invert-depth", help="Near and far change places.")]
Metric = Annotated[bool, typer.Option("--metric", help="The map or the model gives distances: more is farther.")]
Stretch = Annotated[bool, typer.Option("--stretch", help="A map of another shape shows the whole photo.")]
DepthFrom = Annotated[
    DepthStart,
    typer.Option(
        "--depth",
        parser=depth_start_from_text,
        metavar="auto|embedded|model|rough|flat",
        help="Where the search for depth begins: a file (auto), the photo's own, a model, a guess; flat is none.",
    ),
]
DepthModel = Annotated[
    str | None,
    typer.Option(
        "--depth-model",
        metavar="FOLDER|FILE.onnx|NAME",
        help="Trained model for photos without depth, see `iibr models`.",
        show_default="the usual one, if it is there",
    ),
]
Refine = Annotated[
    Any,  # typer makes a flag of a bool
    typer.Option(
        parser=refine_from_text,
        metavar="on|off",
        help="Draw disparity edges to the photo's edges.",
        show_default="on",
    ),
]
DepthStrength = Annotated[float, number_option("Multiply the parallax the plan chose.")]
FocusDisparity = Annotated[float | None, number_option("The disparity (as given) of the plane that stays still.")]
Grid = Annotated[
    GridShape | None,
    typer.Option(parser=grid_from_text, metavar="N|RxC", help="Views to make: 9 is 9x9.", show_default="the plan's"),
]
MaxPixels = Annotated[
    int | None, typer.Option(min=1, max=MOST, help="Larger photos are made smaller.", show_default="2000000")
]
Literal = Annotated[
    bool,
    typer.Option("--literal", help="Disparity counts as given, in px from view to view, not as the window shows it."),
]
Force = Annotated[bool, typer.Option("--force", help="Replace what already exists; what is read, never.")]
PosesFile = Annotated[
    Path | None,
    typer.Option(
        "--poses",
        metavar="FILE",
        help="Cameras that see the photo: poses_bounds.npy, transforms.json or COLMAP's folder.",
        show_default=False,
    ),
]
PhotoPose = Annotated[
    int | None,
    typer.Option(min=1, metavar="N", help="Which of the poses is the photo's.", show_default="the middle one"),
]

LightFieldFormat = Annotated[
    str, typer.Option("--format", parser=format_from_text, metavar="|".join(WRITERS), help="Layout of the folder.")
]

Inpaint = Annotated[
    str,
    typer.Option(
        parser=inpainter_from_text,
        metavar="|".join(INPAINTER_FORMS),
        help="What fills the places that the photo never saw.",
    ),
]
