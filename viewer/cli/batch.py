"""`iibr batch`: every photo of an archive exported, by several processes, here or on other machines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.depth.choice import BETTER_WAYS
from iibr_core.exports.kinds import EXPORTS
from iibr_core.runtime.extras import require_extra
from iibr_core.types import InputError
from viewer.cli.export_options import KindOptions, To, require_kind
from viewer.cli.lens_options import Aperture, Focus, GlossFile
from viewer.cli.option_records import with_option_records
from viewer.cli.scene_options import PhotoOptions
from viewer.cli.shared_options import Force, Grid, Literal, require_model
from viewer.cli.terminal import show_progress

if TYPE_CHECKING:
    from iibr_core.exports.batch.workers import WorkerSource
    from iibr_core.exports.export_opening import OpenDrawn

MOST_WORKERS = 1024


@dataclass(frozen=True)
class WorkerOptions:
    """Who does the work."""

    workers: Annotated[
        int | None, typer.Option(min=1, max=MOST_WORKERS, help="Processes here.", show_default="one a core")
    ] = None
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Of a Dask scheduler, whose workers do it instead. [bold]Whoever can reach a scheduler can run code as"
            " you[/bold], on its workers and here: outside a network that you trust, use TLS (tls://HOST:PORT).",
        ),
    ] = None
    tls_ca: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Certificate of who signed the scheduler's, PEM.")
    ] = None
    tls_cert: Annotated[Path | None, typer.Option(metavar="FILE", help="Your certificate, PEM.")] = None
    tls_key: Annotated[Path | None, typer.Option(metavar="FILE", help="Its private key, PEM.")] = None

    def source(self) -> WorkerSource:
        """Raises InputError where the options contradict each other."""
        tls = [path for path in (self.tls_ca, self.tls_cert, self.tls_key) if path is not None]
        if tls and (len(tls) < 3 or self.scheduler is None):
            raise InputError("--tls-ca, --tls-cert, --tls-key: give all three, with --scheduler")
        if self.scheduler is None:
            from iibr_core.exports.batch.run import workers_here

            return workers_here(self.workers)
        if self.workers is not None:
            raise InputError("--workers starts processes here, --scheduler uses those elsewhere: leave one out")
        require_extra("batch", "distributed")
        from iibr_core.exports.batch.scheduler import TlsFiles, remote_workers
        from iibr_core.exports.batch.workers import WorkerSource

        return WorkerSource(partial(remote_workers, self.scheduler, TlsFiles(*tls) if tls else None), None)


@with_option_records
def batch(
    context: typer.Context,
    folders: Annotated[list[Path], typer.Argument(help="Folders of photos, and of folders.", show_default=False)],
    to: To,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of all exports.")],
    focus: Focus = None,
    aperture: Aperture = None,
    gloss: GlossFile = None,
    *,
    workers: WorkerOptions,
    told: KindOptions,
    photo: PhotoOptions,
    literal: Literal = False,
    grid: Grid = None,
    force: Force = False,
) -> None:
    """Export every photo of an archive. What is finished is not made again: give the same command to go on, or to add.

    Example: iibr batch photos --to depth -o depths
    """
    require_kind(context, to)
    worker_source = workers.source()
    source = photo.source("", grid, is_literal=literal)
    from iibr_core.exports.batch.archive import photos_in
    from iibr_core.exports.batch.ledger import FAILURES, Ledger, require_batch_place
    from iibr_core.exports.batch.run import run_batch
    from iibr_core.exports.batch.task import BatchSettings

    require_model(source.depth)
    if gloss is not None:
        from iibr_core.scenes.scene_gloss import read_environment

        read_environment(gloss.gloss)
    name = next(name for name, kind in EXPORTS.items() if kind is to)
    settings = BatchSettings(
        name, source, photo.depth_strength, told.options(), focus, aperture, gloss.gloss if gloss else None
    )
    photos = photos_in(folders)
    if not photos:
        raise InputError(f"{' and '.join(map(str, folders))}: no photos in it")
    require_batch_place(output, folders, force)
    open_drawn: OpenDrawn | None = None
    if to.is_drawn:
        from viewer.display.scene_drawer import open_drawn
    with Ledger(output, force) as ledger, show_progress("looking", counts=True) as show:
        done = run_batch(ledger, settings, photos, worker_source, open_drawn, show)
    print(f"{output}: {done.written} written, {done.there_before} there before, {done.failed} failed")
    if done.guessed:
        print(f"{done.guessed} of {done.exported} photos have guessed depth. {BETTER_WAYS}")
    if done.failed:
        raise InputError(f"{output / FAILURES}: tells what failed, and why")
