"""`iibr batch`: every photo of an archive exported, by several processes, here or on other machines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.runtime.extras import require_extra
from iibr_core.types import InputError
from viewer.cli.export_options import KindOptions, To, require_kind
from viewer.cli.lens_options import Aperture, Focus, GlossFile
from viewer.cli.option_records import with_option_records
from viewer.cli.options import Force, Grid, Literal, require_memory, require_model
from viewer.cli.scene_options import PhotoOptions
from viewer.cli.terminal import show_progress
from viewer.model.export_kinds import EXPORTS

MOST_WORKERS = 1024


@with_option_records
def batch(
    context: typer.Context,
    folders: Annotated[list[Path], typer.Argument(help="Folders of photos, and of folders.", show_default=False)],
    to: To,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of all exports.")],
    workers: Annotated[
        int | None, typer.Option(min=1, max=MOST_WORKERS, help="Processes here.", show_default="one a core")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler, whose workers do it instead.")
    ] = None,
    focus: Focus = None,
    aperture: Aperture = None,
    gloss: GlossFile = None,
    *,
    told: KindOptions,
    photo: PhotoOptions,
    literal: Literal = False,
    grid: Grid = None,
    force: Force = False,
) -> None:
    """Export every photo of an archive. What is finished is not made again: give the same command to go on, or to add.

    Example: iibr batch photos --to depth -o depths
    """
    require_extra("batch", "distributed")
    require_kind(context, to)
    if workers is not None and scheduler is not None:
        raise InputError("--workers starts processes here, --scheduler uses those elsewhere: leave one out")
    source = photo.source("", grid, is_literal=literal)
    require_memory(photo.memory, keeps_views=to.is_drawn)
    from viewer.app.batch.archive import photos_in
    from viewer.app.batch.ledger import FAILURES, Ledger, require_batch_place
    from viewer.app.batch.run import run_batch
    from viewer.app.batch.task import BatchSettings

    require_model(source.depth)
    if gloss is not None:
        from viewer.background.gloss import read_environment

        read_environment(gloss.gloss)
    name = next(name for name, kind in EXPORTS.items() if kind is to)
    settings = BatchSettings(
        name, source, photo.depth_strength, told.options(), focus, aperture, gloss.gloss if gloss else None
    )
    photos = photos_in(folders)
    if not photos:
        raise InputError(f"{' and '.join(map(str, folders))}: no photos there")
    require_batch_place(output, folders, force)
    with Ledger(output) as ledger, show_progress("looking", counts=True) as show:
        done = run_batch(ledger, settings, photos, scheduler or workers, show)
    print(f"{output}: {done.written} written, {done.there_before} there before, {done.failed} failed")
    if done.failed:
        raise InputError(f"{output / FAILURES}: tells what failed, and why")
