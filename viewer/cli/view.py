"""`iibr view`: the window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.formats.files import is_folder
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.types import InputError
from viewer.cli.demo import demo_photo
from viewer.cli.options import (
    DepthFrom,
    DepthModel,
    DepthStrength,
    DisparityFile,
    DisparityScale,
    FocusDisparity,
    Grid,
    Inpaint,
    MaxPixels,
    Memory,
    QualityChoice,
    Refine,
    depth_choice,
    require_existing,
    require_heeded,
    require_memory,
    require_model,
    require_utf8,
)


def view(
    context: typer.Context,
    path: Annotated[Path | None, typer.Argument(help="A photo or a light-field folder.", show_default="a demo")] = None,
    disparity: DisparityFile = None,
    disparity_scale: DisparityScale = 1.0,
    depth: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = 1.0,
    depth_strength: DepthStrength = 1.0,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    max_pixels: MaxPixels = None,
    memory: Memory = None,
    quality: QualityChoice = None,
    inpaint: Inpaint = DEFAULT_INPAINTER,
    ground_truth: Annotated[
        Path | None,
        typer.Option("--ground-truth", metavar="FOLDER", help="A light field to compare with.", show_default=False),
    ] = None,
) -> None:
    """Open the viewer.

    Example: iibr view holiday.jpg --disparity holiday.pfm
    """
    from viewer.model.state.app_state import Source

    require_utf8(path, disparity, depth_model, ground_truth)
    path = path.absolute() if path else demo_photo()
    choice = depth_choice(disparity, disparity_scale, depth, depth_model, refine, memory)
    source = Source(str(path), choice, grid, focus_disparity, max_pixels, quality, inpaint)
    require_heeded(context, path)
    require_memory(memory, keeps_views=True)
    require_existing(source)
    require_model(choice)
    if ground_truth is not None and not is_folder(ground_truth):
        raise InputError(f"{ground_truth}: is not a folder; --ground-truth names one with the views of a light field")
    from viewer.app.main_loop import initial_state, run
    from viewer.app.preferences_store import user_folder
    from viewer.model.actions import OpenPath

    truth = str(ground_truth.absolute()) if ground_truth else None
    run(initial_state(OpenPath(source), depth_strength, truth), user_folder())
