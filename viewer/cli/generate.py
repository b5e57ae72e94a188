"""`iibr generate`: the light field of a photo, on disk."""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.types import GridShape
from viewer.cli.option_records import with_option_records
from viewer.cli.options import (
    Force,
    LightFieldFormat,
    PhotoPath,
    grid_from_text,
    inputs_with_sidecar,
    require_existing,
    require_memory,
    require_model,
)
from viewer.cli.scene_options import SceneOptions
from viewer.cli.terminal import print_depth, print_notes, show_progress


@with_option_records
def generate(
    photo: PhotoPath,
    grid: Annotated[GridShape, typer.Option(parser=grid_from_text, metavar="N|RxC", help="Views to make: 9 is 9x9.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write.")],
    scene: SceneOptions,
    format: LightFieldFormat = "hci",
    literal: Annotated[
        bool | None,
        typer.Option(
            "--literal/--planned",
            help="Disparity counts as given, in px from view to view, or as the window shows it.",
            show_default="literal with --disparity",
        ),
    ] = None,
    with_disparity: Annotated[bool, typer.Option("--with-disparity", help="A disparity map for every view.")] = False,
    force: Force = False,
) -> None:
    """Write the light field of a photo: a disparity map that is named counts as it is, in px from view to view; found
    or estimated depth gets the parallax that the window shows.

    Example: iibr generate photo.png --disparity photo.pfm --grid 9 --out field --format hci
    """
    require_memory(scene.memory, keeps_views=False)
    from iibr_core.formats.light_fields.registry import writer_for

    source = scene.source(photo, grid, is_literal=scene.disparity is not None if literal is None else literal)
    require_existing(source)
    new_writer = writer_for(format)
    new_writer.require_place(out, inputs_with_sidecar(source), force)
    require_model(source.depth)

    from iibr_core.color import photo_in_srgb
    from iibr_core.generation.light_field import generate as generated
    from viewer.background.loaded_photo import inpainting_aids, load_photo, make_plan

    with show_progress("reading") as show:
        loaded = load_photo(source, report_progress=lambda progress: show(0, 0, progress.doing), keeps_views=False)
    photo_read = photo_in_srgb(loaded.photo)  # layouts of light fields say nothing of colour
    plan = make_plan(source, loaded, scene.depth_strength, keeps_views=False)
    total = grid.rows * grid.columns
    disparity_read = plan.field_disparity(loaded.disparity)
    with (
        new_writer(out, grid, loaded.photo.focal_px, loaded.photo.name, with_disparity) as writer,
        show_progress("making views") as show,
        closing(
            generated(
                photo_read, disparity_read, plan, inpaint=source.inpaint, aids=inpainting_aids(source, loaded, show)
            )
        ) as views,
    ):
        seconds = 0.0
        for done in range(1, total + 1):
            start = time.perf_counter()
            update = next(views)
            seconds += time.perf_counter() - start
            writer.add(update)
            show(done, total)
    height, width = loaded.photo.size
    print(f"{total} views of {width}x{height} in {seconds:.2f} s ({1000 * seconds / total:.1f} ms per view): {out}")
    print_notes(loaded.photo.notes + loaded.disparity.notes + plan.notes)
    print_depth(loaded.origin)
