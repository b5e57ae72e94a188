"""`iibr plan`: the plan of a photo in words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from viewer.cli.option_records import with_option_records
from viewer.cli.options import FocusDisparity, Grid, SceneOptions


@with_option_records
def plan(
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="A photo (JPEG, PNG, TIFF, EXR, WebP, HEIC, AVIF).")],
    scene: SceneOptions,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
) -> None:
    """Show the planned grid, parallax and cost of a photo without making views.

    Example: iibr plan photo.png --disparity photo.pfm
    """
    from iibr_core.scenes.photo import load_photo, make_plan

    source = scene.source(photo, grid, focus_disparity)
    loaded = load_photo(source)
    chosen = make_plan(source, loaded, scene.depth_strength)
    print(f"{loaded.photo.name}: {loaded.photo.size} px, disparity from {loaded.disparity.source}")
    for line in (*chosen.reasons, *loaded.photo.notes, *loaded.disparity.notes):
        print(f"- {line}")
