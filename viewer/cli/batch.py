"""`iibr batch`: export every photo of some folders, with several processes, on this machine or others."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.exports.batch import FAILURES, BatchSettings, check_batch_folder, photos_in, run_batch
from iibr_core.exports.source import OpenDrawn
from iibr_core.runtime.extras import require_extra
from iibr_core.types import InputError
from viewer.cli.export_options import KindOptions, To, require_kind
from viewer.cli.messages import BETTER_DEPTH, show_progress
from viewer.cli.option_records import option, output_option, with_option_records
from viewer.cli.options import Force, LensOptions, LiteralDisparity, PhotoOptions, require_model

MAX_WORKERS = 1024
DASK = (
    "Dask scheduler (tcp://HOST:PORT or tls://HOST:PORT) whose workers are used instead. [bold]Whoever can reach a"
    " scheduler can run code as you[/bold]: use TLS outside a network that you trust."
)


@with_option_records
def batch(
    context: typer.Context,
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER", help="Folders of photos.")],
    to: To,
    output: Annotated[Path, output_option("Folder of all exports.", "DIR")],
    lens: LensOptions,
    *,
    workers: Annotated[
        int | None, option("Number of processes on this machine.", "N", "1 per core", min=1, max=MAX_WORKERS)
    ] = None,
    dask: Annotated[str | None, option(DASK, "ADDRESS")] = None,
    kind_options: KindOptions,
    photo: PhotoOptions,
    literal: LiteralDisparity = False,
    force: Force = False,
) -> None:
    """Export every photo of some folders. The same command again makes missing and outdated exports only.

    Example: iibr batch photos --to depth -o depths
    """
    kind = require_kind(context, to)
    if dask:
        if workers is not None:
            raise InputError("--workers starts processes here, --dask uses other machines: leave out one of both")
        require_extra("batch", "distributed")
    source = kind_options.finer(photo.source("", literal))
    require_model(source.depth)
    open_drawn: OpenDrawn | None = None
    if kind.is_drawn:
        from viewer.display.offscreen import open_drawn
    settings = BatchSettings(to, source, photo.depth_strength, kind_options.options(), lens.choice(), open_drawn)
    photos = photos_in(folders)
    if not photos:
        raise InputError(f"{' and '.join(map(str, folders))}: no photos in it")
    check_batch_folder(output, folders, force)
    if dask and not is_secure(dask):
        print(f"warning: the connection to {dask} is not encrypted; use tls://HOST:PORT", file=sys.stderr)
    # Processes write nothing to the terminal and import nothing from the working folder.
    os.environ.update(PYTHONWARNINGS="ignore", PYTHONSAFEPATH="1")
    with show_progress("looking", counts=True):
        count = run_batch(photos, settings, output, folders, workers=workers, dask=dask or "", force=force)
    print(f"{output}: {count.written} written, {count.there_before} there before, {count.failed} failed")
    if count.guessed:
        print(f"{count.guessed} of {count.written} written have guessed depth. {BETTER_DEPTH}")
    if count.failed:
        raise InputError(f"{output / FAILURES}: lists what failed, and why")


def is_secure(address: str) -> bool:
    """Return whether a scheduler's address is encrypted (tls://) or on this machine."""
    host = address.rpartition("://")[2].rpartition(":")[0].strip("[]")
    return address.startswith("tls://") or host in ("localhost", "::1") or host.startswith("127.")
