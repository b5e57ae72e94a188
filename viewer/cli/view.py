"""`iibr` and `iibr view`: the window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.formats.lenticular import read_calibration
from iibr_core.scenes.scene import Source
from iibr_core.types import InputError
from viewer.app.preferences_store import last_opened, user_folder
from viewer.cli.option_records import option, with_option_records
from viewer.cli.options import SCENE, SceneOptions, require_heeded, require_source
from viewer.model import stereo
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.demo_photo import demo_photo
from viewer.model.stereo import StereoMode
from viewer.model.tracking import address_of, switch


@with_option_records
def view(
    context: typer.Context,
    path: Annotated[Path | None, typer.Argument(metavar="PATH", help=SCENE, show_default="the demo photo")] = None,
    *,
    scene: SceneOptions,
    tracker: Annotated[
        str | None, option("Follow the head: poses from opentrack at this address.", "udp[:HOST][:PORT]", "off")
    ] = None,
    stereo_mode: Annotated[
        StereoMode | None,
        option("Show a stereo picture, full screen, on a second monitor if there is one.", None, "", "--stereo"),
    ] = None,
    calibration: Annotated[
        Path | None, option("Show a Looking Glass display its pictures, by its calibration (visual.json).", "FILE")
    ] = None,
) -> None:
    """Open the viewer.

    Example: iibr view holiday.jpg --disparity holiday.pfm
    """
    path = path.absolute() if path else demo_photo()
    source = scene.source(path)
    require_heeded(context, path)
    require_source(source)
    if stereo_mode is not None and calibration is not None:
        raise InputError("--stereo arranges two pictures, --calibration tens of them: leave out one of both")
    if tracker is not None:
        address_of(tracker)
    shown = () if stereo_mode is None else (do(stereo.set_mode, stereo_mode), do(stereo.show, True))
    display = () if calibration is None else (do(stereo.show_on, read_calibration(calibration)),)
    open_window(source, scene.depth_strength, do(switch, tracker), *shown, *display)


def open_last_scene() -> None:
    """Open the window on the last scene if it still exists. Raises InputError if no window can be opened."""
    last = last_opened(user_folder())
    open_window(None if last is None else Source(last))


def open_window(source: Source | None, depth_strength: float = 1.0, *actions: Action) -> None:
    """Run the window, first with these actions, until it is closed. Raises InputError if it cannot be opened."""
    try:
        import imgui_bundle  # noqa: F401  its library asks for others of the system
    except ImportError as error:
        raise InputError(
            f"no window can be opened ({error}): install that library; `iibr screenshot` works without a display"
        ) from error
    from viewer.app.main_loop import initial_state, run

    run(AppState() if source is None else initial_state(source, depth_strength), user_folder(), *actions)
