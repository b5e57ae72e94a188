"""`iibr view`: the window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.scenes.scene import Source
from viewer.cli.option_records import with_option_records
from viewer.cli.scene_options import SceneOptions, require_heeded
from viewer.cli.shared_options import (
    SCENE_HELP,
    FocusDisparity,
    Grid,
    require_existing,
    require_model,
    require_utf8,
)
from viewer.model.demo_photo import demo_photo


def open_window() -> None:
    """The window with what was open last, if that is still there. Raises InputError where no window can be opened."""
    from viewer.app.main_loop import initial_state, run
    from viewer.app.preferences_store import last_opened, user_folder
    from viewer.model.state.app_state import AppState

    last = last_opened(user_folder())
    run(initial_state(Source(last)) if last is not None else AppState(), user_folder())


@with_option_records
def view(
    context: typer.Context,
    path: Annotated[Path | None, typer.Argument(help=SCENE_HELP, show_default="a demo")] = None,
    *,
    scene: SceneOptions,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
) -> None:
    """Open the viewer.

    Example: iibr view holiday.jpg --disparity holiday.pfm
    """
    require_utf8(path, scene.disparity, scene.depth_model)
    path = path.absolute() if path else demo_photo()
    source = scene.source(path, grid, focus_disparity)
    require_heeded(context, path)
    require_existing(source)
    require_model(source.depth)
    from viewer.app.main_loop import initial_state, run
    from viewer.app.preferences_store import user_folder

    run(initial_state(source, scene.depth_strength), user_folder())
