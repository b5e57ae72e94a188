"""The `iibr` command. Thin: options to records, one call, a line about the result. Heavy imports wait."""

from __future__ import annotations

import signal
import sys
import time
from contextlib import closing
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.types import DEFAULT_QUALITY, GridShape, InputError, Quality, ViewOffset
from viewer.cli.evaluate import evaluate
from viewer.cli.models import models
from viewer.cli.options import (
    DepthFrom,
    DepthModel,
    DepthStrength,
    DisparityFile,
    DisparityScale,
    FocusDisparity,
    Grid,
    Inpaint,
    MaxPixels,
    Memory,
    PhotoPath,
    QualityChoice,
    Refine,
    ScenePath,
    Size,
    given_options,
    grid_from_text,
    number_option,
    size_from_text,
    view_from_text,
)
from viewer.cli.terminal import Commands, print_depth, print_notes, show_progress

if TYPE_CHECKING:
    from viewer.model.state.app_state import Source

UsageError: Any = typer.BadParameter.__base__
"""Click's, wherever this typer keeps it."""

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
DEMO_FOLDER = Path("out")
DEMO_SIZE = (1280, 800)

app = typer.Typer(
    name="iibr",
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
app.add_typer(models, name="models")
app.command()(evaluate)


class Backend(StrEnum):
    """Where OpenGL comes from without a window."""

    auto = "auto"
    egl = "egl"
    osmesa = "osmesa"


class Format(StrEnum):
    """Layouts of a light field on disk."""

    hci = "hci"


def main() -> None:
    """Run the command line. Bad input ends in one line on stderr and exit code 2, Ctrl-C or SIGTERM in one and 130."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        sys.exit(app(standalone_mode=False) or 0)
    except UsageError as error:
        _end(str(error.format_message()) + " (--help tells more)", EXIT_BAD_INPUT)
    except InputError as error:
        _end(str(error), EXIT_BAD_INPUT)
    except MemoryError as error:
        _end(f"out of memory ({error}): lower --max-pixels, or the --grid", EXIT_BAD_INPUT)
    except (KeyboardInterrupt, typer.Abort):
        _end("interrupted", EXIT_INTERRUPTED)


def _end(message: str, code: int) -> None:
    print(f"iibr: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(code)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"iibr {version('iibr')}")
        raise typer.Exit


@app.callback()
def iibr(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show it.")
    ] = False,
) -> None:
    """One photo becomes a light field you can hold: drag the viewpoint, click to refocus, open the aperture."""


@app.command()
def view(
    path: Annotated[Path | None, typer.Argument(help="A photo or a light-field folder.", show_default="a demo")] = None,
    disparity: DisparityFile = None,
    disparity_scale: DisparityScale = 1.0,
    depth: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = 1.0,
    depth_strength: DepthStrength = 1.0,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    max_pixels: MaxPixels = None,
    memory: Memory = None,
    quality: QualityChoice = DEFAULT_QUALITY,
    inpaint: Inpaint = DEFAULT_INPAINTER,
    ground_truth: Annotated[
        Path | None,
        typer.Option("--ground-truth", metavar="FOLDER", help="A light field to compare with.", show_default=False),
    ] = None,
) -> None:
    """Open the viewer.

    Example: iibr view holiday.jpg --disparity holiday.pfm
    """
    path = path.absolute() if path else _demo_photo()
    ways = DepthChoice(depth, str(disparity) if disparity else None, disparity_scale, depth_model, refine, memory)
    source = _source(path, ways, grid, focus_disparity, max_pixels, quality, inpaint)
    _require_existing(source)
    if ground_truth is not None and not ground_truth.is_dir():
        raise InputError(f"{ground_truth}: is not a folder; --ground-truth names one with the views of a light field")
    from viewer.app.main_loop import initial_state, run
    from viewer.app.preferences_store import user_folder
    from viewer.model.actions import OpenPath

    truth = str(ground_truth.absolute()) if ground_truth else None
    run(initial_state(OpenPath(source), depth_strength, truth), user_folder())


@app.command()
def generate(
    photo: PhotoPath,
    grid: Annotated[GridShape, typer.Option(parser=grid_from_text, metavar="N|RxC", help="Views to make: 9 is 9x9.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write.")],
    disparity: DisparityFile = None,
    disparity_scale: DisparityScale = 1.0,
    depth: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = 1.0,
    format: Annotated[Format, typer.Option(help="Layout of the folder.")] = Format.hci,
    with_disparity: Annotated[bool, typer.Option("--with-disparity", help="A disparity map for every view.")] = False,
    max_pixels: MaxPixels = None,
    memory: Memory = None,
    quality: QualityChoice = DEFAULT_QUALITY,
    inpaint: Inpaint = DEFAULT_INPAINTER,
) -> None:
    """Write the light field of a photo; its disparity counts literally, in pixels per view.

    Example: iibr generate photo.png --disparity photo.pfm --grid 9 --out field --format hci
    """
    from iibr_core.formats.light_fields.hci import HciWriter
    from iibr_core.generation.light_field import generate as generated
    from iibr_core.generation.plan import plan_literal
    from viewer.background.loaded_photo import load_photo

    ways = DepthChoice(depth, str(disparity) if disparity else None, disparity_scale, depth_model, refine, memory)
    with show_progress("reading") as show:
        loaded = load_photo(
            _source(photo, ways, grid, None, max_pixels), report_progress=lambda progress: show(0, 0, progress.doing)
        )
    print_notes(loaded.photo.notes + loaded.disparity.notes)
    plan = plan_literal(loaded.photo, loaded.disparity, grid, memory)
    total = grid.rows * grid.columns
    views = generated(loaded.photo, plan.field_disparity(loaded.disparity), plan, quality=quality, inpaint=inpaint)
    with (
        HciWriter(out, grid, loaded.photo.focal_px, loaded.photo.name, with_disparity) as writer,
        show_progress("making views") as show,
        closing(views),
    ):
        seconds = 0.0
        for done in range(1, total + 1):
            start = time.perf_counter()
            update = next(views)
            seconds += time.perf_counter() - start
            writer.add(update)
            show(done, total)
    print_depth(loaded.origin)
    height, width = loaded.photo.size
    print(f"{total} views of {width}x{height} in {seconds:.2f} s ({1000 * seconds / total:.1f} ms per view): {out}")


@app.command()
def screenshot(
    context: typer.Context,
    path: ScenePath,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Image to write (.png, .exr).")],
    like: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A picture saved before: take its settings, except for those given here.",
            show_default=False,
        ),
    ] = None,
    view: Annotated[
        ViewOffset | None,
        typer.Option(
            parser=view_from_text, metavar="S,T", help="Viewpoint in view steps, right and down.", show_default="0,0"
        ),
    ] = None,
    focus: Annotated[
        float | None, number_option("Disparity that is sharp, px per view step (the panel's Focus).")
    ] = None,
    aperture: Annotated[float | None, number_option("Aperture diameter in view steps.")] = None,
    size: Annotated[
        Size | None,
        typer.Option(parser=size_from_text, metavar="WxH", help="Image size.", show_default="the photo's, or 1280x800"),
    ] = None,
    ui: Annotated[bool, typer.Option("--ui", help="With the panels, as in the window.")] = False,
    backend: Annotated[Backend, typer.Option(help="Where OpenGL comes from.")] = Backend.auto,
    disparity: DisparityFile = None,
    disparity_scale: DisparityScale = 1.0,
    depth: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = 1.0,
    depth_strength: DepthStrength = 1.0,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    max_pixels: MaxPixels = None,
    memory: Memory = None,
    quality: QualityChoice = DEFAULT_QUALITY,
    inpaint: Inpaint = DEFAULT_INPAINTER,
) -> None:
    """Render one picture without a display; its settings are saved in it.

    Example: iibr screenshot photo.png --view 2,-1 --focus 0.5 --aperture 4 -o out.png
    """
    ways = DepthChoice(depth, str(disparity) if disparity else None, disparity_scale, depth_model, refine, memory)
    source = _source(path, ways, grid, focus_disparity, max_pixels, quality, inpaint)
    _require_existing(source)
    from viewer.app.headless import HeadlessViewer
    from viewer.app.image_export import export_image, is_float, settings_of
    from viewer.model.actions import Action, MoveEye, SetAperture, SetFocus, TakeSettings
    from viewer.model.saved_settings import read_settings, source_like

    actions: list[Action] = []
    edits = UNEDITED
    if like is not None:
        saved, given = read_settings(like), given_options(context)
        source = source_like(source, saved, given)
        size = size or (None if ui else Size(*saved.size_px))
        depth_strength = depth_strength if "depth_strength" in given else saved.depth_strength
        edits = saved.depth_edits
        actions.append(TakeSettings(saved))
    actions += [] if view is None else [MoveEye(view)]
    actions += [] if focus is None else [SetFocus(focus)]
    actions += [] if aperture is None else [SetAperture(aperture)]
    with HeadlessViewer(backend.value) as viewer:
        if ui and not viewer.has_panels:
            raise InputError("--ui: the panels cannot be drawn through OSMesa; use EGL (install libegl1), or no --ui")
        with show_progress("reading") as show:
            viewer.open(source, depth_strength, lambda made: show(made.done, made.total, made.doing), edits)
        if viewer.state.scene is not None:
            print_depth(viewer.state.scene.depth_origin)
            print_notes(viewer.state.scene.notes)
        viewer.do(*actions)
        pixels = viewer.screen(size or DEMO_SIZE) if ui else viewer.picture(size, is_float(output))
    export_image(output, pixels, None if ui else settings_of(viewer.state, (pixels.shape[1], pixels.shape[0])))
    print(output)


@app.command()
def plan(
    photo: PhotoPath,
    disparity: DisparityFile = None,
    disparity_scale: DisparityScale = 1.0,
    depth: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = 1.0,
    depth_strength: DepthStrength = 1.0,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    max_pixels: MaxPixels = None,
    memory: Memory = None,
) -> None:
    """Say what this photo needs, and why, without making any view.

    Example: iibr plan photo.png --disparity photo.pfm
    """
    from iibr_core.generation.plan import PlanOverrides, plan_for_viewing
    from viewer.background.loaded_photo import load_photo

    ways = DepthChoice(depth, str(disparity) if disparity else None, disparity_scale, depth_model, refine, memory)
    loaded = load_photo(_source(photo, ways, grid, focus_disparity, max_pixels))
    chosen = plan_for_viewing(
        loaded.photo, loaded.disparity, PlanOverrides(grid, depth_strength, focus_disparity, memory)
    )
    height, width = loaded.photo.size
    print(f"{loaded.photo.name}: {width}x{height} px, disparity from {loaded.disparity.source}")
    for line in (*chosen.reasons, *loaded.photo.notes, *loaded.disparity.notes):
        print(f"- {line}")


@app.command()
def train(
    steps: Annotated[int, typer.Option(min=1, help="Batches of rays to learn from.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Weights to write (.safetensors).")],
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="The same seed gives the same weights.")] = 0,
    learning_rate: Annotated[float, typer.Option(max=1.0, help="Of the first step; it falls to 0 over all.")] = 1e-4,
    device: Annotated[str, typer.Option(metavar="NAME", help="auto, cpu, cuda, cuda:1 or mps.")] = "auto",
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint beside the weights.")] = False,
    checkpoint_every: Annotated[int, typer.Option(min=1, help="Steps from one checkpoint to the next.")] = 500,
) -> None:
    """Train the ray transformer on made-up scenes. Ctrl-C saves, --resume goes on; a log lies beside the weights.

    Example: iibr train --steps 2500 --learning-rate 3e-3 --out weights.safetensors
    """
    from viewer.cli.train import train_weights

    raise typer.Exit(train_weights(steps, out, seed, learning_rate, device, resume, checkpoint_every))


@app.command(hidden=True, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def bench() -> None:
    """Measure the program itself: no longer a command, but part of the source.

    Example: make bench
    """
    raise InputError("bench measures the program itself; in its source, run: make bench DATA=FOLDER OUT=FOLDER")


@app.command()
def demo() -> None:
    """Open the viewer on the demo photo; without a display, render it to out/demo.png and out/demo-views.png.

    Example: iibr demo
    """
    from viewer.app.main_loop import App, initial_state
    from viewer.app.preferences_store import user_folder
    from viewer.model.actions import OpenPath
    from viewer.model.state.app_state import Source

    source = Source(str(_demo_photo()))
    try:
        window = App(initial_state(OpenPath(source)), user_folder())
    except InputError as error:
        print(f"{error}. Rendering without one.")
        _demo_pictures(source)
        return
    try:
        window.run()
    finally:
        window.close()


def _demo_pictures(source: Source) -> None:
    from viewer.app.contact_sheet import contact_sheet
    from viewer.app.headless import HeadlessViewer
    from viewer.app.image_export import export_image

    DEMO_FOLDER.mkdir(exist_ok=True)
    with HeadlessViewer() as viewer:
        with show_progress("reading") as show:
            viewer.open(source, 1.0, lambda progress: show(progress.done, progress.total, progress.doing))
        export_image(DEMO_FOLDER / "demo.png", viewer.screen(DEMO_SIZE) if viewer.has_panels else viewer.picture())
        export_image(DEMO_FOLDER / "demo-views.png", contact_sheet(viewer))
    print(f"{DEMO_FOLDER / 'demo.png'}: the viewer's window")
    print(f"{DEMO_FOLDER / 'demo-views.png'}: viewpoints above, focus from near to far below")


def _source(
    path: Path,
    ways: DepthChoice,
    grid: GridShape | None,
    focus_disparity: float | None,
    max_pixels: int | None,
    quality: Quality = DEFAULT_QUALITY,
    inpaint: str = DEFAULT_INPAINTER,
) -> Source:
    from viewer.model.state.app_state import Source

    return Source(str(path), ways, grid, focus_disparity, max_pixels, quality, inpaint)


def _require_existing(source: Source) -> None:
    """Say so before a window opens, rather than in it."""
    for path in (source.path, source.depth.file):
        if path is not None and not Path(path).exists():
            raise InputError(f"{path}: no such file")


def _demo_photo() -> Path:
    from iibr_core.runtime.resources import resource_folder

    return resource_folder("assets") / "motorcycle" / "motorcycle.png"
