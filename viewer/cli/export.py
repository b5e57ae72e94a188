"""`iibr export`: write a photo or a light field as quilts, stereo pictures, animations, light fields and more."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.exports import kinds
from iibr_core.exports.animation import read_keys
from iibr_core.exports.source import OpenDrawn, open_for_export, write_export
from iibr_core.scenes.scene import Scene
from viewer.cli import options as shared
from viewer.cli.export_options import KindOptions, To, require_kind
from viewer.cli.messages import print_notes, show_progress
from viewer.cli.option_records import flag, option, output_option, with_option_records


@with_option_records
def export(
    context: typer.Context,
    path: shared.ScenePath,
    to: To,
    output: Annotated[Path, output_option("File or folder to write.", "PATH")],
    lens: shared.LensOptions,
    kind_options: KindOptions,
    keys: Annotated[
        Path | None,
        option(
            "File with a camera path, one key per line: s t, s t focus, or s t focus aperture.", "FILE", "", "--path"
        ),
    ] = None,
    row: Annotated[int | None, option("Row of an epipolar plane image.", "N", "the middle", min=0)] = None,
    show: Annotated[
        bool, flag("--show", "Show the quilt on the connected Looking Glass display, by its Bridge.")
    ] = False,
    *,
    scene: shared.SceneOptions,
    literal: shared.LiteralDisparity = False,
    force: shared.Force = False,
) -> None:
    """Write a scene, as the window shows it, in a format for displays, browsers or other programs.

    Example: iibr export photo.png --to quilt --device portrait -o photo.png
    """
    kind = require_kind(context, to)
    source = kind_options.finer(scene.source(path, literal))
    shared.require_heeded(context, path)
    kinds.require_ending(kind, output)
    inputs = shared.inputs_of_command(context, source)
    if keys is not None:
        read_keys(keys)
    if not kind.path:
        kinds.require_export_place(kind, output, inputs, force)
    shared.require_source(source)
    options, target, choice = kind_options.options(keys, row, show), output, lens.choice()

    def require_place(opened: Scene) -> None:
        nonlocal target
        if kind.is_drawn:
            lens.require_within(opened)
        target = kinds.export_path(kind, output, opened, options)
        kinds.require_export_place(kind, target, inputs, force)

    with ExitStack() as stack:
        open_drawn: OpenDrawn | None = None
        if kind.is_drawn:
            from viewer.display.offscreen import OffscreenScene

            open_drawn = stack.enter_context(OffscreenScene()).open_for_export
        with show_progress("reading"):
            opened = open_for_export(kind, options, source, scene.depth_strength, choice, require_place, open_drawn)
        with show_progress("exporting"):
            message = write_export(kind, target, opened, options)
    print(target)
    notes = lens.limit_notes(opened.optics, opened.scene)
    if "aperture" in kind.supports:
        notes += choice.notes(opened.optics, opened.scene)
    print_notes(*opened.scene.notes, *notes, message, origin=opened.scene.depth_origin)
