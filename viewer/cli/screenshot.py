"""`iibr screenshot`: one picture, without a display."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.exports.full_picture import require_full
from iibr_core.formats.images.picture_kinds import AS_USUAL, BEST_QUALITY, KINDS, PROFILES, PictureFormat, is_float
from iibr_core.scenes.lens_limits import LensChoice
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ImageSize, InputError
from viewer.app.picture_files import export_picture, require_picture_place, shot_of
from viewer.cli.lens_options import LensOptions
from viewer.cli.option_records import with_option_records
from viewer.cli.options import (
    FocusDisparity,
    Force,
    Grid,
    SceneOptions,
    ScenePath,
    given_options,
    inputs_of_command,
    name_in,
    require_heeded,
    require_source,
    size_from_text,
)
from viewer.cli.progress import print_notes, show_progress
from viewer.model import lens as lens_verbs
from viewer.model import opening
from viewer.model.state.app_state import AppState

if TYPE_CHECKING:
    from viewer.display.offscreen import OffscreenScene
    from viewer.model.state.saving import SavedSettings


@dataclass(frozen=True)
class FileOptions:
    """Options of the picture's file."""

    bits: Annotated[
        int | None, typer.Option(metavar="N", help="Bits per channel: 16 for .png, .tif, .exr.", show_default="8")
    ] = None
    picture_quality: Annotated[
        int, typer.Option(min=1, max=BEST_QUALITY, metavar="N", help="Quality of .jpg, .webp and .avif.")
    ] = AS_USUAL.quality
    profile: Annotated[
        str | None,
        typer.Option(
            parser=name_in(PROFILES),
            metavar="|".join(PROFILES),
            help="Colour profile: sRGB or Display P3.",
            show_default="p3 for photos with more colours than sRGB",
        ),
    ] = None
    gps: Annotated[bool, typer.Option("--gps", help="Keep the photo's GPS position.")] = False

    @property
    def format(self) -> PictureFormat:
        """Return the same for the core."""
        profile = None if self.profile is None else PROFILES[self.profile]
        return PictureFormat(self.bits, self.picture_quality, profile, self.gps)


@with_option_records
def screenshot(
    context: typer.Context,
    path: ScenePath,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help=f"File to write: {', '.join(KINDS)}.")],
    like: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Saved picture whose settings are used, except for options given here.",
            show_default=False,
        ),
    ] = None,
    *,
    lens: LensOptions,
    size: Annotated[
        ScreenSize | None,
        typer.Option(
            parser=size_from_text, metavar="WxH", help="Size of the picture in pixels.", show_default="that of a view"
        ),
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="Draw at the photo's own size, from all its pixels.")] = False,
    file: FileOptions,
    backend: Annotated[Literal["auto", "egl", "osmesa"], typer.Option(help="Source of OpenGL.")] = "auto",
    scene: SceneOptions,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    force: Force = False,
) -> None:
    """Draw one picture without a display; its settings are saved in it.

    Up to the photo's own size (--size, --full), all pixels of the photo are used, even if views are smaller
    (--max-pixels).

    Example: iibr screenshot photo.png --view 2,-1 --focus 0.5 --aperture 4 -o out.png
    """
    source, depth_strength = scene.source(path, grid, focus_disparity), scene.depth_strength
    require_heeded(context, path)
    if full and size is not None:
        raise InputError("--full sets the size of the picture: leave out --size")
    settings = None if like is None else _read_settings(like, size)
    notes: tuple[str, ...] = ()
    if settings is not None:
        from viewer.model.saved_settings import left_out_note, source_like

        given = given_options(context)
        source = source_like(source, settings, given)
        depth_strength = depth_strength if "depth_strength" in given else settings.depth_strength
        size = size or ScreenSize(*settings.size_px)
        notes = tuple(filter(None, [left_out_note(settings)]))
    require_picture_place(output, size, inputs_of_command(context, source), force, file.format)
    require_source(source)
    choice = lens.choice()
    from iibr_core.formats.images.photo import smaller_note
    from viewer.display.offscreen import OffscreenScene

    with OffscreenScene(backend) as viewer:

        def set_lens(opened: Scene) -> Collection[Optics]:
            lens.require_within(opened)
            viewer.state = _with_lens(viewer.state, settings, choice)
            return () if viewer.draws_own_pixels(_size_of(viewer, size, full)) else (viewer.state.optics,)

        with show_progress("reading"):
            opened = viewer.open(source, depth_strength, settings.depth_edits if settings else UNEDITED, set_lens)
        size = _size_of(viewer, size, full)
        shot = shot_of(viewer.state, size or opened.size, file.format)
        with show_progress("drawing"):
            pixels = viewer.picture(size, is_float(output, file.format), shot.color_space)
        optics, draws_own = viewer.state.optics, viewer.draws_own_pixels(size)
    export_picture(output, pixels, shot)
    print(output)
    own_size, view_size = (ImageSize(size.height, size.width) for size in (opened.own_size or opened.size, opened.size))
    unimportant = smaller_note(own_size, view_size) if draws_own else ""
    notes += tuple(note for note in opened.notes if note != unimportant)
    print_notes(notes + lens.notes(optics), opened.depth_origin)


def _read_settings(path: Path, size: ScreenSize | None) -> SavedSettings:
    """Return the settings of a saved picture. Raises InputError if there are none, or their size is too large."""
    from viewer.model.saved_settings import read_settings, require_saved_size

    settings = read_settings(path)
    if size is None:
        require_saved_size(settings, path)
    return settings


def _with_lens(state: AppState, settings: SavedSettings | None, choice: LensChoice) -> AppState:
    """Return the state with saved settings, and with the lens of the options."""
    state = state if settings is None else opening.take_settings(state, settings)
    state = state if choice.eye is None else lens_verbs.move_eye(state, choice.eye)
    state = state if choice.focus is None else lens_verbs.set_focus(state, choice.focus)
    state = state if choice.aperture is None else lens_verbs.set_aperture(state, choice.aperture)
    return state if choice.gloss is None else lens_verbs.set_gloss(state, choice.gloss)


def _size_of(viewer: OffscreenScene, size: ScreenSize | None, is_full: bool) -> ScreenSize | None:
    """Return the size of the picture, None for that of a view.

    Raises InputError if all pixels of the photo are asked for and cannot be drawn.
    """
    if not is_full:
        return size
    if viewer.state.optics.gloss is not None:
        raise InputError("--full: gloss is drawn from the views, which may be smaller; leave out one of both")
    require_full(viewer.scene)
    return viewer.scene.own_size or viewer.scene.size
