"""`iibr screenshot`: one picture, without a display."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.exports.full_picture import require_full
from iibr_core.exports.render_settings import MAX_PIXELS
from iibr_core.formats.images.picture_kinds import AS_USUAL, BEST_QUALITY, KINDS, PROFILES, PictureFormat, is_float
from iibr_core.formats.lenticular import Calibration, read_calibration
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ImageSize, InputError
from viewer.app.picture_files import export_picture, read_settings, require_picture_place, shot_of
from viewer.cli import options as shared
from viewer.cli.messages import print_notes, show_progress
from viewer.cli.option_records import flag, option, output_option, with_option_records
from viewer.model import opening
from viewer.model.app_state import AppState
from viewer.model.saving import SavedSettings
from viewer.model.stereo import Stereo

if TYPE_CHECKING:
    from viewer.display.offscreen import OffscreenScene

SET_BY_DISPLAY = {"size", "full", "bits", "picture_quality", "profile"}
"""Options that a display's screen leaves no choice about."""
LOSSLESS = ".png", ".tif", ".tiff"


@dataclass(frozen=True)
class FileOptions:
    """Options of the picture's file."""

    bits: Annotated[int | None, option("Bits per channel: 16 for .png, .tif, .exr.", "N", "8")] = None
    picture_quality: Annotated[int, option("Quality of .jpg, .webp and .avif.", "N", min=1, max=BEST_QUALITY)] = (
        AS_USUAL.quality
    )
    profile: Annotated[
        str | None,
        option(
            "Colour profile: sRGB or Display P3.",
            "|".join(PROFILES),
            "p3 for photos with more colours than sRGB",
            parser=shared.name_in(PROFILES),
        ),
    ] = None
    gps: Annotated[bool, flag("--gps", "Keep the photo's GPS position.")] = False

    @property
    def format(self) -> PictureFormat:
        """Return the same for the core."""
        profile = None if self.profile is None else PROFILES[self.profile]
        return PictureFormat(self.bits, self.picture_quality, profile, self.gps)


@with_option_records
def screenshot(
    context: typer.Context,
    path: shared.ScenePath,
    output: Annotated[Path, output_option(f"File to write: {', '.join(KINDS)}.")],
    like: Annotated[
        Path | None, option("Saved picture whose settings are used, except for options given here.", "FILE")
    ] = None,
    *,
    lens: shared.LensOptions,
    size: Annotated[
        ScreenSize | None,
        option("Size of the picture in pixels.", "WxH", "that of a view", parser=shared.size_from_text),
    ] = None,
    full: Annotated[bool, flag("--full", "Draw at the photo's own size, from all its pixels.")] = False,
    calibration: Annotated[
        Path | None, option("Calibration of a Looking Glass display (visual.json): draw what its screen shows.", "FILE")
    ] = None,
    file: FileOptions,
    backend: Annotated[Literal["auto", "egl", "osmesa"], option("Source of OpenGL.")] = "auto",
    scene: shared.SceneOptions,
    force: shared.Force = False,
) -> None:
    """Draw one picture without a display; its settings are saved in it.

    Pictures up to the photo's own size (--size, --full) use all of its pixels, even if views are smaller.

    Example: iibr screenshot photo.png --focus-at 480,620 --f-number 1.8 --blades 7 -o out.png
    """
    source, depth_strength = scene.source(path), scene.depth_strength
    shared.require_heeded(context, path)
    if full and size is not None:
        raise InputError("--full sets the size of the picture: leave out --size")
    display = _display(context, calibration, output)
    form = file.format if display is None else PictureFormat(color_space=SRGB, keeps_position=file.gps)
    settings, note = None, ""
    if like is not None:
        settings, given = read_settings(like), shared.given_options(context)
        source, size, note = _like(settings, like, source, size, given)
        depth_strength = depth_strength if "depth_strength" in given else settings.depth_strength
    size = size if display is None else ScreenSize(*display.screen[::-1])
    require_picture_place(output, size, shared.inputs_of_command(context, source), force, form)
    shared.require_source(source)
    choice = lens.choice()
    from viewer.display.offscreen import OffscreenScene

    with OffscreenScene(backend) as viewer:

        def set_lens(opened: Scene) -> Collection[Optics]:
            lens.require_within(opened)
            viewer.state = _with_lens(viewer, settings, choice, display)
            return viewer.optics_of_picture(_size_of(viewer, size, full))

        with show_progress("reading"):
            opened = viewer.open(source, depth_strength, settings.depth_edits if settings else UNEDITED, set_lens)
        size = _size_of(viewer, size, full)
        shot = shot_of(viewer.state, size or opened.size, form)
        with show_progress("drawing"):
            pixels = viewer.picture(size, is_float(output, form), shot.color_space)
        optics, draws_own = viewer.state.optics, viewer.draws_own_pixels(size)
    export_picture(output, pixels, shot)
    print(output)
    notes = _notes_without_views(opened) if draws_own else opened.notes
    print_notes(
        note, *notes, *lens.limit_notes(optics, opened), *choice.notes(optics, opened), origin=opened.depth_origin
    )


def _like(
    settings: SavedSettings, like: Path, source: Source, size: ScreenSize | None, given: set[str]
) -> tuple[Source, ScreenSize, str]:
    """Return source and size of the picture that repeats a saved one, but for given options, and a note on the rest."""
    from viewer.model import saved_settings

    if size is None:
        saved_settings.require_saved_size(settings, like)
    source = saved_settings.source_like(source, settings, given)
    return source, size or ScreenSize(*settings.size_px), saved_settings.left_out_note(settings)


def _notes_without_views(scene: Scene) -> list[str]:
    """Return the notes on a scene, but for that on the size of its views."""
    from iibr_core.formats.images.photo import smaller_note

    own_size, view_size = (ImageSize(size.height, size.width) for size in (scene.own_size or scene.size, scene.size))
    return [note for note in scene.notes if note != smaller_note(own_size, view_size)]


def _display(context: typer.Context, calibration: Path | None, output: Path) -> Calibration | None:
    """Return the display whose screen is drawn, None without one."""
    if calibration is None:
        return None
    shared.require_not_given(context, SET_BY_DISPLAY, "the screen of --calibration sets size and colours")
    if output.suffix.lower() not in LOSSLESS:
        raise InputError(f"{output}: each subpixel belongs to a view of its own; save them as {' or '.join(LOSSLESS)}")
    return read_calibration(calibration)


def _with_lens(
    viewer: OffscreenScene, settings: SavedSettings | None, choice: LensChoice, display: Calibration | None
) -> AppState:
    """Return the state with saved settings, and with lens and display of the options."""
    state = viewer.state if settings is None else opening.take_settings(viewer.state, settings)
    state = replace(state, optics=choice.optics_on(viewer.scene, viewer.disparity, state.optics))
    return replace(state, stereo=Stereo(display=display, screen=state.optics.focus_disparity))


def _size_of(viewer: OffscreenScene, size: ScreenSize | None, is_full: bool) -> ScreenSize | None:
    """Return the size of the picture, None for that of a view.

    Raises InputError if all pixels of the photo are asked for and cannot be drawn.
    """
    if not is_full:
        return size
    if viewer.state.optics.gloss is not None:
        raise InputError("--full: gloss is drawn from the views, which may be smaller; leave out one of both")
    own_size = viewer.scene.own_size or viewer.scene.size
    if math.prod(own_size) > MAX_PIXELS:
        from iibr_core.formats.images.photo import size_within

        largest = size_within(ImageSize(own_size.height, own_size.width), MAX_PIXELS)
        raise InputError(f"--full: the photo has more than {MAX_PIXELS // 10**6} million pixels; give --size {largest}")
    require_full(viewer.scene)
    return own_size
