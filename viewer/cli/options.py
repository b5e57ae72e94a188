"""Options that commands share: their values from text, and the records that hold them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Set
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import typer

from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthChoice, DepthStart
from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.formats.light_fields.order import Arrangement, Flip, Order
from iibr_core.gloss.settings import Gloss
from iibr_core.inpainting.registry import DEFAULT_INPAINTER, INPAINTER_FORMS, require_inpainter
from iibr_core.scenes.f_numbers import aperture_of
from iibr_core.scenes.inputs import inputs_of
from iibr_core.scenes.lens_choice import LENS_LIMITS, LensChoice
from iibr_core.scenes.lens_limits import eye_limits
from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, InputError, ViewOffset
from viewer.cli.option_records import flag, option

MAX_GRID = 999
"""Largest number of views in a row or column."""
MAX_SIDE_PX = 16384


def grid_from_text(text: str) -> GridShape:
    """Return a grid of views: "9" is 9x9, "3x9" is 3 rows of 9. Raises BadParameter."""
    match = re.fullmatch(r"(\d{1,4})(?:x(\d{1,4}))?", text.strip())
    grid = GridShape(int(match[1]), int(match[2] or match[1])) if match else GridShape(0, 0)
    if not all(1 <= count <= MAX_GRID for count in grid):
        raise typer.BadParameter(f"{text!r} is not a grid: give 1 to {MAX_GRID}, such as 9 or 3x9")
    return grid


def size_from_text(text: str) -> ScreenSize:
    """Return a size from "1280x800". Raises BadParameter."""
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text.strip())
    size = ScreenSize(int(match[1]), int(match[2])) if match else ScreenSize(0, 0)
    if not all(1 <= side <= MAX_SIDE_PX for side in size):
        raise typer.BadParameter(f"{text!r} is not a size: give width x height in pixels, such as 1280x800")
    return size


def view_from_text(text: str) -> ViewOffset:
    """Return a view offset from "S,T": steps to the right, then down. Raises BadParameter."""
    s, t = _two_numbers(text, "is not a viewpoint: give S,T in view steps, such as 2,-1.5")
    return ViewOffset(t, s)


class Pair(NamedTuple):
    """Two numbers: to the right, and down."""

    x: float
    y: float


def pair_from_text(text: str) -> Pair:
    """Return two numbers from "X,Y". Raises BadParameter."""
    return _two_numbers(text, "are not two numbers: give X,Y, such as 480,620")


def _two_numbers(text: str, problem: str) -> Pair:
    """Return two numbers with a comma between them. problem: words behind the text in a BadParameter."""
    try:
        first, second = map(number_from_text, text.split(","))
    except (ValueError, typer.BadParameter):
        raise typer.BadParameter(f"{text!r} {problem}") from None
    return Pair(first, second)


def number_from_text(text: str) -> float:
    """Return a finite number. Raises ValueError and BadParameter."""
    value = float(text)
    if not math.isfinite(value):
        raise typer.BadParameter(f"{text!r} is not a finite number")
    return value


def name_in(names: Collection[str]) -> Callable[[str], str]:
    """Return a parser of an option whose values are names in a table."""

    def name_from_text(text: str) -> str:
        if text not in names:
            raise typer.BadParameter(f"{text!r} is not known: give {', '.join(names)}")
        return text

    return name_from_text


def inpainter_from_text(text: str) -> str:
    """Return the name of an inpainter, with its folder if it has one. Raises BadParameter."""
    try:
        require_inpainter(text)
    except InputError as error:
        raise typer.BadParameter(str(error)) from None
    return text


SCENE = "A photo, a stereo photo, or a light field: a folder of views, a quilt, a lenslet image."
ScenePath = Annotated[Path, typer.Argument(metavar="PATH", help=SCENE)]
RightPath = Annotated[
    Path | None,
    typer.Argument(
        metavar="RIGHT", help="The photo of the right eye, if PATH is that of the left.", show_default=False
    ),
]
Force = Annotated[bool, flag("--force", "Replace an existing output. Inputs are never replaced.")]
Grid = Annotated[
    GridShape | None,
    option(
        "Grid of views, rows x columns: 9 is 9x9.",
        "N|RxC",
        "chosen by the plan, or found from the files",
        parser=grid_from_text,
    ),
]
LiteralDisparity = Annotated[
    bool, flag("--literal", "Take disparity as given, in px per view step; the plan does not scale it.")
]
DepthModel = Annotated[
    str | None,
    option(
        "Depth model for photos without depth, see `iibr models`.",
        "NAME|FOLDER|FILE.onnx",
        "the recommended one, if it is there",
    ),
]
Refine = Annotated[Literal["on", "off"], option("Move edges of the disparity to edges of the photo.")]
MaxPixels = Annotated[int | None, option("Reduce larger photos to this number of pixels.", "N", "2 million", min=1)]


ViewOrder = Annotated[
    Order | None,
    option(
        "Order in which names count the views of a light field: row by row (or the row first), column by column, or"
        " every other one backwards.",
        default="found from the views",
    ),
]
ViewFlip = Annotated[
    Flip | None,
    option(
        "Axes along which names count from right to left (x) or from bottom to top (y).", default="found from the views"
    ),
]


@dataclass(frozen=True)
class DepthOptions:
    """Options of commands that find the depth of photos."""

    depth: Annotated[
        DepthStart, option("First source of depth: a map's file (auto), the photo's own, a model, a guess, or none.")
    ] = "auto"
    depth_model: DepthModel = None
    refine: Refine = "on"
    invert_depth: Annotated[bool, flag("--invert-depth", "Swap near and far.")] = False
    metric: Annotated[bool, flag("--metric", "The map or the model gives distances.")] = False
    stretch: Annotated[bool, flag("--stretch", "Stretch a map of another shape to the photo.")] = False

    @property
    def choice(self) -> DepthChoice:
        """Return the same for the core. Raises InputError if the options contradict each other."""
        if self.depth_model is not None and self.depth not in ("auto", "model"):
            raise InputError(f"--depth {self.depth} asks no model: leave out --depth-model")
        return DepthChoice(
            self.depth if self.depth_model is None else "model",
            inverts=self.invert_depth,
            is_metric=self.metric,
            stretches=self.stretch,
            model=self.depth_model,
            refine=self.refine == "on",
        )


@dataclass(frozen=True)
class PhotoOptions(DepthOptions):
    """Options of commands that make views of photos."""

    grid: Grid = None
    focus_disparity: Annotated[
        float | None, option("Disparity, as given, of the plane that stays still.", "X", parser=number_from_text)
    ] = None
    depth_strength: Annotated[float, option("Multiply the parallax that the plan chose.", "X")] = 1.0
    max_pixels: MaxPixels = None
    inpaint: Annotated[
        str,
        option(
            "Method that fills areas which the photo does not show.",
            "|".join(INPAINTER_FORMS),
            parser=inpainter_from_text,
        ),
    ] = DEFAULT_INPAINTER

    def source(self, path: Path | str, is_literal: bool = False) -> Source:
        """Return the source to open. Raises InputError if the options contradict each other."""
        if is_literal and self.grid is None:
            raise InputError("--literal takes disparity in px per view step: give the number of views with --grid")
        if is_literal and (self.focus_disparity is not None or self.depth_strength != 1):
            raise InputError("--literal takes disparity as given: leave out --depth-strength and --focus-disparity")
        made_by = self.grid, self.focus_disparity, self.max_pixels, self.inpaint, is_literal
        return Source(str(path), self.choice, *made_by)


@dataclass(frozen=True)
class SceneOptions(PhotoOptions):
    """Options of commands that open one photo or light field."""

    disparity: Annotated[
        Path | None,
        option(
            "Depth map. PFM, EXR, NPY: disparity in px per view step. PNG, JPEG, WebP: white is near, unless the"
            " photo shows otherwise.",
            "FILE",
        ),
    ] = None
    disparity_scale: Annotated[
        float | None, option("Factor from the map's values to px per view step; -1: black is near.", "X")
    ] = None
    order: ViewOrder = None
    flip: ViewFlip = None
    right: RightPath = None

    @property
    def choice(self) -> DepthChoice:
        """See `DepthOptions.choice`."""
        if self.disparity is not None and (self.depth != "auto" or self.depth_model is not None):
            raise InputError("--disparity gives the depth: leave out --depth and --depth-model")
        file = None if self.disparity is None else str(self.disparity)
        right = None if self.right is None else str(self.right.absolute())
        return replace(super().choice, file=file, file_scale=self.disparity_scale, right=right)

    def source(self, path: Path | str, is_literal: bool = False) -> Source:
        """Return the source to open; the grid of a light field is that of its views. See `PhotoOptions.source`."""
        return with_arrangement(super().source(path, is_literal), Arrangement(self.order, self.grid, self.flip))


def with_arrangement(source: Source, arrangement: Arrangement) -> Source:
    """Return the source of a light field with this order of its views; of a photo, unchanged.

    Raises InputError if an order is given for a photo.
    """
    if is_light_field(Path(source.path)):
        if source.depth.right is not None:
            raise InputError(
                f"{source.depth.right}: {source.path} is a light field, not the left eye's photo; leave it out"
            )
        return replace(source, arrangement=arrangement, grid=None)
    if arrangement.order or arrangement.flip:
        raise InputError(f"--order and --flip are for light fields, which {source.path} is not; leave them out")
    return source


GlossFile = Annotated[
    Path | None,
    option("Make a surface glossy: a TOML file with roughness, reflectance, \\[surface] and \\[light].", "FILE"),
]


def lens_number(name: str, text: str, metavar: str = "X") -> Any:
    """Return an option for a number of the lens, with its limits."""
    low, high = LENS_LIMITS[name]
    return option(text, metavar, min=low, max=None if math.isinf(high) else high)


@dataclass(frozen=True)
class LensOptions:
    """Values of the options of the lens, None if an option is not given."""

    view: Annotated[
        ViewOffset | None, option("Viewpoint in view steps, right and down.", "S,T", "0,0", parser=view_from_text)
    ] = None
    focus: Annotated[
        float | None,
        option(
            "Disparity in focus, px per view step (Focus in the panel); it lies in the plane of a 3D display.",
            "X",
            parser=number_from_text,
        ),
    ] = None
    focus_at: Annotated[
        Pair | None,
        option("Place of the photo in focus: pixels from the left and the top.", "X,Y", parser=pair_from_text),
    ] = None
    focus_range: Annotated[
        float | None, lens_number("focus_range", "Disparity before and behind the focus that is sharp, too.")
    ] = None
    tilt: Annotated[
        Pair | None,
        option("Change of the focus to the right and to the lower border, in disparity.", "X,Y", parser=pair_from_text),
    ] = None
    aperture: Annotated[float | None, lens_number("aperture", "Aperture diameter in view steps.")] = None
    f_number: Annotated[
        float | None, lens_number("f_number", "Aperture as f-number of a full-frame lens, as the window shows it.", "N")
    ] = None
    blades: Annotated[int | None, lens_number("blades", "Polygon with so many corners as aperture.", "N")] = None
    roundness: Annotated[
        float | None, lens_number("roundness", "Roundness of the sides between blades: 0 is straight, 1 a circle.")
    ] = None
    rotation: Annotated[
        float | None, option("Turn of blades or a mask, clockwise.", "DEG", parser=number_from_text)
    ] = None
    ring: Annotated[float | None, lens_number("ring", "Ring as aperture; blocked share of its radius.")] = None
    cat_eye: Annotated[
        float | None, lens_number("cat_eye", "Round aperture that the barrel cuts off in the corners.")
    ] = None
    mask: Annotated[Path | None, option("Grey picture as aperture, white is open.", "FILE")] = None
    highlights: Annotated[
        float | None, lens_number("highlights", "Stops by which clipped light counts for more than white.")
    ] = None
    gloss: GlossFile = None

    def choice(self) -> LensChoice:
        """Return the same for the core. Raises InputError if a file cannot be read, and for options at odds."""
        mask = None
        if self.mask is not None:
            from iibr_core.beyond.aperture_mask import read_mask  # imports numpy

            mask = read_mask(self.mask)
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        eye = given.pop("view")
        return LensChoice(**given | {"eye": eye, "gloss": gloss_of(self.gloss), "mask": mask})

    def require_within(self, scene: Scene) -> None:
        """Raise InputError for a viewpoint outside the scene's views; a single view shows every viewpoint."""
        if self.view is None or scene.grid == (1, 1):
            return
        for axis, value, views in (("S", self.view.s, scene.grid.columns), ("T", self.view.t, scene.grid.rows)):
            low, high = eye_limits(views)
            if not low <= value <= high:
                raise InputError(f"--view: {axis} is {value:g}; {scene.name} has {low:g} to {high:g}")

    def limit_notes(self, optics: Optics, scene: Scene) -> tuple[str, ...]:
        """Return a note for each value that the scene limits."""
        right, down = self.tilt or (None, None)
        pairs = (
            ("--focus", self.focus, optics.focus_disparity),
            ("--aperture", self.aperture, optics.aperture_diameter),
            ("--focus-range", self.focus_range, optics.focus_range),
            ("--tilt to the right,", right, optics.focus_tilt[0]),
            ("--tilt down,", down, optics.focus_tilt[1]),
        )
        notes = [
            f"{name} {value:g} exceeds what the scene has; {used:g} is used."
            for name, value, used in pairs
            if value not in (None, used)
        ]
        wanted = None if self.f_number is None else aperture_of(scene, self.f_number)
        if self.f_number is not None and wanted is not None and wanted > optics.aperture_diameter > 0:
            widest = self.f_number * wanted / optics.aperture_diameter
            notes.append(f"--f-number {self.f_number:g} is wider than the lens opens; f/{widest:.2g} is used.")
        if scene.plan is None and optics.aperture_diameter > max(scene.grid):
            notes.append("The lens is wider than the light field: what no view shows is inpainted.")
        return tuple(notes)


def gloss_of(path: Path | None) -> Gloss | None:
    """Return the gloss in a file. Raises InputError."""
    if path is None:
        return None
    from viewer.app.gloss_file import read_gloss  # imports msgspec

    return read_gloss(path)


NOT_FOR_LIGHT_FIELDS = {field.name for field in fields(PhotoOptions)} - {"grid"}
"""Options about how views are made: a light field brings its views. The disparity of its centre view may be given."""


def given_options(context: typer.Context) -> set[str]:
    """Return the names of the options that were given, not left at their defaults."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    return {name for name, source in sources.items() if source is not None and source.name != "DEFAULT"}


def require_not_given(context: typer.Context, names: Set[str], reason: str) -> None:
    """Raise InputError if any of these options was given."""
    typed = [each.opts[0] for each in context.command.params if each.name in given_options(context) & names]
    if typed:
        raise InputError(f"{' and '.join(typed)}: {reason}; leave it out")


def require_heeded(context: typer.Context, path: Path, unheeded: Set[str] = NOT_FOR_LIGHT_FIELDS) -> None:
    """Raise InputError if options were given that a light field at `path` would ignore."""
    if context.params.get("disparity") is None:
        unheeded = unheeded | {"disparity_scale"}
    if given_options(context) & unheeded and is_light_field(path):
        require_not_given(context, unheeded, f"{path} is a light field, whose views are taken as they are")


def require_source(source: Source) -> None:
    """Raise InputError if a file that is opened does not exist, or a model that is asked for cannot be used."""
    for path in (source.path, source.depth.file, source.depth.right):
        if path is not None and not Path(path).exists():
            raise InputError(f"{path}: no such file")
    require_model(source.depth)


def require_model(choice: DepthChoice) -> None:
    """Raise InputError if a depth model is asked for that cannot be used."""
    if choice.asks_for_model:
        from iibr_core.depth.models.catalog import model_to_use

        model_to_use(choice)


def inputs_of_command(context: typer.Context, source: Source | None = None) -> tuple[Path, ...]:
    """Return what a command reads and must not overwrite: every path except its output, and the inputs of a source."""
    values = [value for name, value in context.params.items() if name != "output"]
    named = [path for value in values for path in (value if isinstance(value, list) else [value])]
    return (*(path for path in named if isinstance(path, Path)), *(() if source is None else inputs_of(source)))
