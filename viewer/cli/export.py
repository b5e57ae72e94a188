"""`iibr export`: a photo or a light field as what others open: quilts, stereo, animations, stacks, light fields, ..."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.rendering.gloss.settings import Gloss
from viewer.app.exports.registry import export_path, require_export_place, writer_of
from viewer.cli.export_options import KindOptions, To, require_kind
from viewer.cli.lens_options import LensOptions
from viewer.cli.option_records import with_option_records
from viewer.cli.options import (
    MOST,
    FocusDisparity,
    Force,
    Grid,
    Literal,
    ScenePath,
    inputs_of_command,
    require_existing,
    require_memory,
    require_model,
)
from viewer.cli.scene_options import SceneOptions, require_heeded
from viewer.cli.terminal import print_depth, print_notes, show_progress, untimed
from viewer.model.export_kinds import require_ending

if TYPE_CHECKING:
    from viewer.app.exports.source import ExportSource
    from viewer.model.state.scene import Scene, Source


@with_option_records
def export(
    context: typer.Context,
    path: ScenePath,
    to: To,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="PATH", help="File or folder to write.")],
    lens: LensOptions,
    told: KindOptions,
    keys: Annotated[
        Path | None,
        typer.Option(
            "--path",
            metavar="FILE",
            help="Keys of a path of your own, a line each: s t, s t focus, or s t focus aperture.",
        ),
    ] = None,
    row: Annotated[
        int | None, typer.Option(min=0, max=MOST, help="Row of the picture.", show_default="the middle")
    ] = None,
    show: Annotated[
        bool, typer.Option("--show", help="On the Looking Glass display that is connected, by its Bridge.")
    ] = False,
    *,
    scene: SceneOptions,
    literal: Literal = False,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    force: Force = False,
) -> None:
    """Write a scene as what others open, as the window shows it.

    Example: iibr export photo.png --to quilt --device portrait -o photo.png
    """
    require_kind(context, to)
    source = scene.source(path, grid, focus_disparity, literal)
    require_heeded(context, path)
    require_memory(scene.memory, keeps_views=to.is_drawn)
    require_existing(source)
    require_ending(to, output)
    inputs = inputs_of_command(context, source)
    if keys is not None:
        from viewer.app.exports.animation import read_keys

        read_keys(keys)
    if not to.path:
        require_export_place(to, output, inputs, force)
    require_model(source.depth)
    options = told.options(keys, row, show)
    target = output

    def require_place(made: Scene) -> None:
        nonlocal target
        target = export_path(to, output, made, options)
        require_export_place(to, target, inputs, force)

    def write(made: ExportSource) -> None:
        said = writer_of(to)(target, made, options)
        print(target)
        print_depth(made.scene.depth_origin)
        print_notes(made.scene.notes + lens.notes(made.optics) + ((said,) if said else ()))

    if to.is_drawn:
        _export_drawn(source, scene.depth_strength, lens, require_place, write)
    else:
        gloss = lens.gloss.gloss if lens.gloss else None
        _export_undrawn(source, scene.depth_strength, gloss, not to.layout, require_place, write)


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
            made = open_drawn(viewer, source, depth_strength, lens.actions(), look_at, untimed(show))
        with show_progress("exporting") as show:
            write(replace(made, report_progress=show))


def _export_undrawn(
    source: Source,
    depth_strength: float,
    gloss: Gloss | None,
    needs_disparity: bool,
    require_place: Callable[[Scene], None],
    write: Callable[[ExportSource], None],
) -> None:
    """Make the scene's views, for what is made of them without a graphics card. needs_disparity: see `open_undrawn`."""
    from viewer.app.exports.opening import open_undrawn

    with show_progress("reading") as show:
        made = open_undrawn(source, depth_strength, needs_disparity, require_place, untimed(show), gloss)
    with show_progress("exporting") as show:
        write(replace(made, report_progress=show))
