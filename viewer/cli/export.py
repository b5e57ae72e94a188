"""`iibr export`: a photo or a light field as what others open: quilts, stereo, animations, stacks, light fields, ..."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.formats.quilts import DEVICES
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.runtime.extras import require_extra
from iibr_core.types import InputError, ViewOffset
from viewer.app.exports.registry import export_path, require_export_place, writer_of
from viewer.cli.lens_options import LensOptions
from viewer.cli.options import (
    MOST,
    DepthFrom,
    DepthModel,
    DepthStrength,
    DisparityFile,
    DisparityScale,
    FocusDisparity,
    Force,
    Grid,
    Inpaint,
    Literal,
    MaxPixels,
    Memory,
    QualityChoice,
    Refine,
    ScenePath,
    depth_choice,
    given_options,
    inputs_with_sidecar,
    not_negative_from_text,
    number_option,
    require_existing,
    require_heeded,
    require_memory,
    require_model,
    size_from_text,
    view_from_text,
)
from viewer.cli.terminal import print_depth, print_notes, show_progress
from viewer.model.export_kinds import EXPORTS, ExportKind, export_kind, require_ending
from viewer.model.layout import ScreenSize
from viewer.model.state.exporting import ANIMATIONS, AnimationKind, ExportOptions

if TYPE_CHECKING:
    from viewer.app.exports.source import ExportSource
    from viewer.model.state.app_state import Scene, Source

ABOUT_EXPORTS = ("view", "focus", "aperture", "size", "device", "eyes", "motion", "keys", "frames", "rate", "row")
"""Options that some kinds heed and others do not."""
MOST_FRAMES, MOST_RATE = 10_000, 240.0


def kind_from_text(text: str) -> ExportKind:
    """What to export, by name. Raises BadParameter."""
    try:
        return export_kind(text)
    except InputError as error:
        raise typer.BadParameter(str(error)) from error


def device_from_text(text: str) -> str:
    """A light-field display, by name. Raises BadParameter."""
    if text not in DEVICES:
        raise typer.BadParameter(f"{text!r} is no display that is known: give {', '.join(DEVICES)}")
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
    if not 0.1 <= rate <= MOST_RATE:
        raise typer.BadParameter(f"{text!r} is no rate: give 0.1 to {MOST_RATE:g} frames a second")
    return rate


def export(
    context: typer.Context,
    path: ScenePath,
    to: Annotated[
        ExportKind, typer.Option("--to", parser=kind_from_text, metavar="KIND", help=f"One of {', '.join(EXPORTS)}.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="PATH", help="File or folder to write.")],
    view: Annotated[
        ViewOffset | None,
        typer.Option(
            parser=view_from_text, metavar="S,T", help="Viewpoint in view steps, right and down.", show_default="0,0"
        ),
    ] = None,
    focus: Annotated[
        float | None, number_option("Disparity that is sharp, and lies in the screen of displays, px per view step.")
    ] = None,
    aperture: Annotated[
        float | None,
        typer.Option(parser=not_negative_from_text, metavar="X", help="Aperture diameter in view steps."),
    ] = None,
    size: Annotated[
        ScreenSize | None,
        typer.Option(parser=size_from_text, metavar="WxH", help="Of each picture.", show_default="the photo's"),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(
            parser=device_from_text, metavar="NAME", help=f"Display to make a quilt for: {', '.join(DEVICES)}."
        ),
    ] = None,
    eyes: Annotated[
        float | None,
        typer.Option(
            parser=not_negative_from_text, metavar="X", help="View steps between two eyes.", show_default="the grid"
        ),
    ] = None,
    motion: Annotated[
        AnimationKind | None,
        typer.Option(parser=motion_from_text, metavar="|".join(ANIMATIONS), help="What moves.", show_default="circle"),
    ] = None,
    keys: Annotated[
        Path | None,
        typer.Option("--path", metavar="FILE", help="Keys of a path of your own, a line each: s t [focus [aperture]]."),
    ] = None,
    frames: Annotated[
        int | None, typer.Option(min=1, max=MOST_FRAMES, help="Of an animation, or pictures of a stack.")
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(parser=rate_from_text, metavar="X", help="Frames a second.", show_default="30"),
    ] = None,
    row: Annotated[
        int | None, typer.Option(min=0, max=MOST, help="Row of the picture.", show_default="the middle")
    ] = None,
    literal: Literal = False,
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
    quality: QualityChoice = None,
    inpaint: Inpaint = DEFAULT_INPAINTER,
    force: Force = False,
) -> None:
    """Write a scene as what others open, as the window shows it.

    Example: iibr export photo.png --to quilt --device portrait -o photo.png
    """
    require_kind_heeds(context, to)
    from viewer.model.state.app_state import Source

    choice = depth_choice(disparity, disparity_scale, depth, depth_model, refine, memory)
    source = Source(str(path), choice, grid, focus_disparity, max_pixels, quality, inpaint, literal)
    require_heeded(context, path)
    if literal and grid is None:
        raise InputError("--literal counts disparity in px from view to view: say how many with --grid")
    require_memory(memory, keeps_views=to.is_drawn)
    require_existing(source)
    require_ending(to, output)
    if to.needs:
        require_extra("export", *to.needs)
    inputs = inputs_with_sidecar(source, keys)
    if keys is not None:
        from viewer.app.exports.animation import read_keys

        read_keys(keys)
    if not to.path:
        require_export_place(to, output, inputs, force)
    require_model(choice)
    options = ExportOptions(size, device, eyes, motion, keys, frames, rate, row)
    target = output

    def require_place(scene: Scene) -> None:
        nonlocal target
        target = export_path(to, output, scene, options)
        require_export_place(to, target, inputs, force)

    def write(made: ExportSource) -> None:
        said = writer_of(to)(target, made, options)
        print(target)
        print_depth(made.scene.depth_origin)
        print_notes(made.scene.notes + lens.notes(made.optics) + ((said,) if said else ()))

    lens = LensOptions(view, focus, aperture)
    if to.is_drawn:
        _export_drawn(source, depth_strength, lens, require_place, write)
    else:
        _export_undrawn(source, depth_strength, not to.layout, require_place, write)


def require_kind_heeds(context: typer.Context, kind: ExportKind) -> None:
    """Raise InputError for options given that this kind would not heed."""
    given = (given_options(context) & set(ABOUT_EXPORTS)) - set(kind.heeds)
    if given:
        options = sorted(parameter.opts[0] for parameter in context.command.params if parameter.name in given)
        name = next(name for name, known in EXPORTS.items() if known is kind)
        raise InputError(f"{' and '.join(options)}: means nothing to --to {name}; leave it out")


def _export_drawn(
    source: Source,
    depth_strength: float,
    lens: LensOptions,
    require_place: Callable[[Scene], None],
    write: Callable[[ExportSource], None],
) -> None:
    """Make the scene's views and draw them."""
    from viewer.app.exports.opening import open_drawn
    from viewer.app.headless import HeadlessViewer

    def look_at(scene: Scene) -> None:
        lens.require_within(scene)
        require_place(scene)

    with HeadlessViewer() as viewer:
        with show_progress("reading") as show:
            made = open_drawn(viewer, source, depth_strength, lens.actions(), look_at, show)
        with show_progress("exporting") as show:
            write(replace(made, report_progress=show))


def _export_undrawn(
    source: Source,
    depth_strength: float,
    needs_disparity: bool,
    require_place: Callable[[Scene], None],
    write: Callable[[ExportSource], None],
) -> None:
    """Make the scene's views, for what is made of them without a graphics card. needs_disparity: see `open_undrawn`."""
    from viewer.app.exports.opening import open_undrawn

    with show_progress("reading") as show:
        made = open_undrawn(source, depth_strength, needs_disparity, require_place, show)
    with show_progress("exporting") as show:
        write(replace(made, report_progress=show))
