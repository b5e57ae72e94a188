"""`iibr export`: a photo or a light field as what others open: quilts, stereo, animations, stacks, light fields, ..."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.exports.kinds import require_ending
from iibr_core.exports.writers import export_path, require_export_place, writer_of
from viewer.cli.export_options import KindOptions, To, require_kind
from viewer.cli.lens_options import LensOptions
from viewer.cli.option_records import with_option_records
from viewer.cli.scene_options import SceneOptions, require_heeded
from viewer.cli.shared_options import (
    MOST,
    FocusDisparity,
    Force,
    Grid,
    Literal,
    ScenePath,
    inputs_of_command,
    require_existing,
    require_model,
)
from viewer.cli.terminal import print_depth, print_notes, show_progress, untimed

if TYPE_CHECKING:
    from iibr_core.exports.export_opening import OpenDrawn
    from iibr_core.exports.kinds import ExportKind
    from iibr_core.exports.options import ExportOptions
    from iibr_core.exports.source import ExportSource
    from iibr_core.scenes.scene import Scene, Source


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
    require_existing(source)
    require_ending(to, output)
    inputs = inputs_of_command(context, source)
    if keys is not None:
        from iibr_core.exports.animation import read_keys

        read_keys(keys)
    if not to.path:
        require_export_place(to, output, inputs, force)
    require_model(source.depth)
    options = told.options(keys, row, show)
    target = output

    def require_place(made: Scene) -> None:
        nonlocal target
        if to.is_drawn:
            lens.require_within(made)
        target = export_path(to, output, made, options)
        require_export_place(to, target, inputs, force)

    made, said = _carry_out(to, source, scene.depth_strength, lens, require_place, lambda: target, options)
    print(target)
    print_depth(made.scene.depth_origin)
    print_notes(made.scene.notes + lens.notes(made.optics) + ((said,) if said else ()))


def _carry_out(
    kind: ExportKind,
    source: Source,
    depth_strength: float,
    lens: LensOptions,
    on_ready: Callable[[Scene], None],
    target: Callable[[], Path],
    options: ExportOptions,
) -> tuple[ExportSource, str | None]:
    """Open the scene and write it; a graphics card is needed for what is drawn alone. target: known by `on_ready`."""
    from iibr_core.exports.export_opening import open_for_export

    open_drawn: OpenDrawn | None = None
    with ExitStack() as held:
        if kind.is_drawn:
            from viewer.display.scene_drawer import SceneDrawer

            open_drawn = held.enter_context(SceneDrawer()).open
        with show_progress("reading") as show:
            made = open_for_export(
                kind, options, source, depth_strength, lens.choice, on_ready, open_drawn, untimed(show)
            )
        with show_progress("exporting") as show:
            return made, writer_of(kind)(target(), replace(made, report_progress=show), options)
