"""`iibr export`: write a photo or a light field as quilts, stereo pictures, animations, light fields and more."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.exports.kinds import export_path, require_ending, require_export_place
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
from viewer.cli.terminal import print_depth, print_notes, show_progress

if TYPE_CHECKING:
    from iibr_core.exports.kinds import ExportKind, ExportOptions
    from iibr_core.exports.source import ExportSource, OpenDrawn
    from iibr_core.scenes.scene import Scene, Source


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
            help="File with a camera path, one key a line: s t, s t focus, or s t focus aperture.",
        ),
    ] = None,
    row: Annotated[
        int | None,
        typer.Option(min=0, max=MOST, help="Row of an epipolar plane image.", show_default="the middle"),
    ] = None,
    show: Annotated[
        bool, typer.Option("--show", help="Show the quilt on the connected Looking Glass display, by its Bridge.")
    ] = False,
    *,
    scene: SceneOptions,
    literal: Literal = False,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    force: Force = False,
) -> None:
    """Write a scene, as the window shows it, in a format for displays, browsers or other programs.

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
    options = kind_options.options(keys, row, show)
    target = output

    def require_place(ready: Scene) -> None:
        nonlocal target
        if to.is_drawn:
            lens.require_within(ready)
        target = export_path(to, output, ready, options)
        require_export_place(to, target, inputs, force)

    opened, message = _carry_out(to, source, scene.depth_strength, lens, require_place, lambda: target, options)
    print(target)
    print_depth(opened.scene.depth_origin)
    print_notes(opened.scene.notes + lens.notes(opened.optics) + ((message,) if message else ()))


def _carry_out(
    kind: ExportKind,
    source: Source,
    depth_strength: float,
    lens: LensOptions,
    on_ready: Callable[[Scene], None],
    target: Callable[[], Path],
    options: ExportOptions,
) -> tuple[ExportSource, str | None]:
    """Open the scene and write the export. target: returns its path, which `on_ready` determines."""
    from iibr_core.exports.source import open_for_export, write_export

    open_drawn: OpenDrawn | None = None
    with ExitStack() as stack:
        if kind.is_drawn:
            from viewer.display.offscreen import OffscreenScene

            open_drawn = stack.enter_context(OffscreenScene()).open_for_export
        with show_progress("reading"):
            opened = open_for_export(kind, options, source, depth_strength, lens.choice, on_ready, open_drawn)
        with show_progress("exporting"):
            return opened, write_export(kind, target(), opened, options)
