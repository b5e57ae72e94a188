"""`iibr batch`: every photo of an archive exported, by several processes, here or on other machines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.runtime.extras import require_extra
from iibr_core.types import InputError
from viewer.cli.export import device_from_text, kind_from_text, motion_from_text, rate_from_text, require_kind_heeds
from viewer.cli.options import (
    DepthFrom,
    DepthModel,
    DepthStrength,
    Force,
    Grid,
    Inpaint,
    Literal,
    MaxPixels,
    Memory,
    QualityChoice,
    Refine,
    depth_choice,
    not_negative_from_text,
    number_option,
    require_memory,
    require_model,
    size_from_text,
)
from viewer.cli.terminal import show_progress
from viewer.model.export_kinds import EXPORTS, ExportKind
from viewer.model.layout import ScreenSize
from viewer.model.state.exporting import ANIMATIONS, AnimationKind, ExportOptions

MOST_WORKERS = 1024


def batch(
    context: typer.Context,
    folders: Annotated[list[Path], typer.Argument(help="Folders of photos, and of folders.", show_default=False)],
    to: Annotated[
        ExportKind, typer.Option("--to", parser=kind_from_text, metavar="KIND", help=f"One of {', '.join(EXPORTS)}.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of all exports.")],
    workers: Annotated[
        int | None, typer.Option(min=1, max=MOST_WORKERS, help="Processes here.", show_default="one a core")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler, whose workers do it instead.")
    ] = None,
    focus: Annotated[float | None, number_option("Disparity that is sharp, px per view step.")] = None,
    aperture: Annotated[
        float | None,
        typer.Option(parser=not_negative_from_text, metavar="X", help="Aperture diameter in view steps."),
    ] = None,
    size: Annotated[
        ScreenSize | None,
        typer.Option(parser=size_from_text, metavar="WxH", help="Of each picture.", show_default="the photo's"),
    ] = None,
    device: Annotated[
        str | None, typer.Option(parser=device_from_text, metavar="NAME", help="Display to make quilts for.")
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
    frames: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="Of an animation, or pictures of a stack.")
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(parser=rate_from_text, metavar="X", help="Frames a second.", show_default="30"),
    ] = None,
    literal: Literal = False,
    depth: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = 1.0,
    depth_strength: DepthStrength = 1.0,
    grid: Grid = None,
    max_pixels: MaxPixels = None,
    memory: Memory = None,
    quality: QualityChoice = None,
    inpaint: Inpaint = DEFAULT_INPAINTER,
    force: Force = False,
) -> None:
    """Export every photo of an archive. What is finished is not made again: give the same command to go on, or to add.

    Example: iibr batch photos --to depth -o depths
    """
    require_extra("batch", "distributed")
    require_kind_heeds(context, to)
    if to.needs:
        require_extra("export", *to.needs)
    if workers is not None and scheduler is not None:
        raise InputError("--workers starts processes here, --scheduler uses those elsewhere: leave one out")
    if literal and grid is None:
        raise InputError("--literal counts disparity in px from view to view: say how many with --grid")
    require_memory(memory, keeps_views=to.is_drawn)
    from viewer.app.batch.archive import photos_in
    from viewer.app.batch.ledger import FAILURES, Ledger, require_batch_place
    from viewer.app.batch.run import run_batch
    from viewer.app.batch.task import BatchSettings
    from viewer.model.state.app_state import Source

    choice = depth_choice(None, 1.0, depth, depth_model, refine, memory)
    require_model(choice)
    name = next(name for name, kind in EXPORTS.items() if kind is to)
    source = Source("", choice, grid, None, max_pixels, quality, inpaint, literal)
    options = ExportOptions(size, device, eyes, motion, None, frames, rate)
    settings = BatchSettings(name, source, depth_strength, options, focus, aperture)
    photos = photos_in(folders)
    if not photos:
        raise InputError(f"{' and '.join(map(str, folders))}: no photos there")
    require_batch_place(output, folders, force)
    with Ledger(output) as ledger, show_progress("looking", counts=True) as show:
        done = run_batch(ledger, settings, photos, scheduler or workers, show)
    print(f"{output}: {done.written} written, {done.there_before} there before, {done.failed} failed")
    if done.failed:
        raise InputError(f"{output / FAILURES}: tells what failed, and why")
