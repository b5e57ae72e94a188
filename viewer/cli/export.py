"""`iibr export`: write a photo or a light field as quilts, stereo pictures, animations, light fields and more."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.exports.animation import read_keys
from iibr_core.exports.kinds import export_path, require_ending, require_export_place
from iibr_core.exports.source import open_for_export, write_export
from viewer.cli.export_options import KindOptions, To, require_kind
from viewer.cli.lens_options import LensOptions
from viewer.cli.option_records import with_option_records
from viewer.cli.options import (
    FocusDisparity,
    Force,
    Grid,
    LiteralDisparity,
    SceneOptions,
    ScenePath,
    inputs_of_command,
    require_heeded,
    require_source,
)
from viewer.cli.progress import print_notes, show_progress

if TYPE_CHECKING:
    from iibr_core.exports.source import OpenDrawn
    from iibr_core.scenes.scene import Scene


@with_option_records
def export(
    context: typer.Context,
    path: ScenePath,
    to: To,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="PATH", help="File or folder to write.")],
    lens: LensOptions,
    kind_options: KindOptions,
    keys: Annotated[
        Path | None,
        typer.Option(
            "--path",
            metavar="FILE",
            help="File with a camera path, one key per line: s t, s t focus, or s t focus aperture.",
        ),
    ] = None,
    row: Annotated[
        int | None,
        typer.Option(min=0, metavar="N", help="Row of an epipolar plane image.", show_default="the middle"),
    ] = None,
    show: Annotated[
        bool, typer.Option("--show", help="Show the quilt on the connected Looking Glass display, by its Bridge.")
    ] = False,
    *,
    scene: SceneOptions,
    literal: LiteralDisparity = False,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    force: Force = False,
) -> None:
    """Write a scene, as the window shows it, in a format for displays, browsers or other programs.

    Example: iibr export photo.png --to quilt --device portrait -o photo.png
    """
    kind = require_kind(context, to)
    source = scene.source(path, grid, focus_disparity, literal)
    require_heeded(context, path)
    require_ending(kind, output)
    inputs = inputs_of_command(context, source)
    if keys is not None:
        read_keys(keys)
    if not kind.path:
        require_export_place(kind, output, inputs, force)
    require_source(source)
    options, target = kind_options.options(keys, row, show), output

    def require_place(opened: Scene) -> None:
        nonlocal target
        if kind.is_drawn:
            lens.require_within(opened)
        target = export_path(kind, output, opened, options)
        require_export_place(kind, target, inputs, force)

    with ExitStack() as stack:
        open_drawn: OpenDrawn | None = None
        if kind.is_drawn:
            from viewer.display.offscreen import OffscreenScene

            open_drawn = stack.enter_context(OffscreenScene()).open_for_export
        with show_progress("reading"):
            opened = open_for_export(
                kind, options, source, scene.depth_strength, lens.choice(), require_place, open_drawn
            )
        with show_progress("exporting"):
            message = write_export(kind, target, opened, options)
    print(target)
    notes = (*opened.scene.notes, *lens.notes(opened.optics), *filter(None, (message,)))
    print_notes(notes, opened.scene.depth_origin)
