"""`iibr screenshot`: one picture, without a display."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.formats.images.picture_kinds import AS_USUAL, BEST_QUALITY, KINDS, PROFILES, PictureFormat, is_float
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ColorSpace, InputError
from viewer.cli.lens_options import NO_LENS_OPTIONS, LensOptions
from viewer.cli.option_records import with_option_records
from viewer.cli.scene_options import SceneOptions, require_heeded
from viewer.cli.shared_options import (
    SCREEN_SIZE,
    FocusDisparity,
    Force,
    Grid,
    ScenePath,
    given_options,
    inputs_of_command,
    require_existing,
    require_model,
    require_utf8,
    size_from_text,
)
from viewer.cli.terminal import print_depth, print_notes, show_progress
from viewer.model import opening
from viewer.model.action import do

if TYPE_CHECKING:
    from iibr_core.beyond.optics import Optics
    from iibr_core.depth.choice import DepthOrigin
    from iibr_core.scenes.scene import Scene, Source
    from viewer.display.offscreen import OffscreenScene
    from viewer.model.action import Action


class Backend(StrEnum):
    """Where OpenGL comes from without a window."""

    auto = "auto"
    egl = "egl"
    osmesa = "osmesa"


@dataclass(frozen=True)
class _Shot:
    """What is opened, and what is done to it before the picture is taken. size: None for the usual one. is_full: at
    the photo's own size. notes: to be said with it. form: how it is written.
    """

    source: Source
    depth_strength: float
    size: ScreenSize | None
    edits: DepthEdits = UNEDITED
    actions: tuple[Action, ...] = ()
    notes: tuple[str, ...] = ()
    is_full: bool = False
    lens: LensOptions = NO_LENS_OPTIONS
    form: PictureFormat = AS_USUAL


def profile_from_text(text: str) -> ColorSpace:
    """A colour profile by name. Raises BadParameter."""
    if text not in PROFILES:
        raise typer.BadParameter(f"{text!r} is no profile: give {' or '.join(PROFILES)}")
    return PROFILES[text]


@dataclass(frozen=True)
class FileOptions:
    """How the picture is written."""

    bits: Annotated[
        int | None,
        typer.Option(metavar="N", help="16 for .png, .tif, .exr: of a channel.", show_default="the usual"),
    ] = None
    picture_quality: Annotated[
        int, typer.Option(min=1, max=BEST_QUALITY, metavar="N", help="Of .jpg, .webp and .avif.")
    ] = AS_USUAL.quality
    profile: Annotated[
        ColorSpace | None,
        typer.Option(
            parser=profile_from_text,
            metavar="|".join(PROFILES),
            help="Colours of the picture: sRGB, Display P3.",
            show_default="p3 for photos with more colours than sRGB",
        ),
    ] = None
    gps: Annotated[bool, typer.Option("--gps", help="Keep the place where the photo was taken.")] = False

    @property
    def form(self) -> PictureFormat:
        """The same as a record."""
        return PictureFormat(self.bits, self.picture_quality, self.profile, self.gps)


@with_option_records
def screenshot(
    context: typer.Context,
    path: ScenePath,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help=f"To write: {', '.join(KINDS)}.")],
    like: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="A picture saved before: take its settings, except for those given here.",
            show_default=False,
        ),
    ] = None,
    *,
    lens: LensOptions,
    size: Annotated[
        ScreenSize | None,
        typer.Option(parser=size_from_text, metavar="WxH", help="Image size.", show_default="the photo's, or 1280x800"),
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="At the photo's own size, from all its pixels.")] = False,
    file: FileOptions,
    ui: Annotated[bool, typer.Option("--ui", help="With the panels, as in the window.")] = False,
    backend: Annotated[Backend, typer.Option(help="Where OpenGL comes from.")] = Backend.auto,
    scene: SceneOptions,
    focus_disparity: FocusDisparity = None,
    grid: Grid = None,
    force: Force = False,
) -> None:
    """Render one picture without a display; its settings are saved in it.

    Up to the photo's own size (--size, --full) all of its pixels count, however small the views are (--max-pixels).

    Example: iibr screenshot photo.png --view 2,-1 --focus 0.5 --aperture 4 -o out.png
    """
    from viewer.app.picture_files import require_picture_place

    shot = _Shot(scene.source(path, grid, focus_disparity), scene.depth_strength, size)
    require_heeded(context, path)
    require_existing(shot.source)
    if full and (ui or size is not None):
        raise InputError(f"--full: gives the picture its size, leave {'--ui' if ui else '--size'} away")
    if ui:
        require_utf8(path, scene.disparity, scene.depth_model)
    if like is not None:
        shot = _shot_like(shot, like, given_options(context), ui)
    form = file.form
    require_picture_place(output, shot.size, inputs_of_command(context, shot.source), force, form)
    require_model(shot.source.depth)
    shot = replace(shot, lens=lens, is_full=full, form=form)
    notes, origin = _write(shot, output, ui, backend)
    print(output)
    print_depth(origin)
    print_notes(shot.notes + notes)


def _shot_like(shot: _Shot, like: Path, given: Collection[str], ui: bool) -> _Shot:
    """With the settings of a picture saved before, except for the options given."""
    from viewer.model.saved_settings import left_out_note, read_settings, require_saved_size, source_like

    saved = read_settings(like)
    if shot.size is None and not ui:
        require_saved_size(saved, like)
    return _Shot(
        source_like(shot.source, saved, given),
        shot.depth_strength if "depth_strength" in given else saved.depth_strength,
        shot.size or (None if ui else ScreenSize(*saved.size_px)),
        saved.depth_edits,
        (do(opening.take_settings, saved),),
        tuple(filter(None, [left_out_note(saved)])),
    )


def _size_of(shot: _Shot, viewer: OffscreenScene) -> ScreenSize | None:
    """Of the picture. Raises InputError where all of the photo's pixels are asked for and cannot be drawn."""
    from iibr_core.exports.full_picture import require_full

    if not shot.is_full:
        return shot.size
    if viewer.state.optics.gloss is not None:
        raise InputError("--full: gloss is drawn from the views, which may be smaller; leave one of both out")
    require_full(viewer.scene)
    return viewer.scene.own_size or viewer.scene.size


def _pictures_of(scene: Scene, shot: _Shot, viewer: OffscreenScene, ui: bool) -> Collection[Optics] | None:
    """Set the lens; return the optics of the picture if it shows views, None if it shows the panels, too."""
    shot.lens.require_within(scene)
    viewer.do(*shot.actions, *shot.lens.actions())
    if ui:
        return None
    return () if viewer.draws_own_pixels(_size_of(shot, viewer)) else (viewer.state.optics,)


def _write(shot: _Shot, output: Path, ui: bool, backend: Backend) -> tuple[tuple[str, ...], DepthOrigin | None]:
    """Draw the picture and write it; returns what is to be said of the scene, and where its depth came from."""
    from iibr_core.formats.images.photo import MADE_SMALLER
    from iibr_core.formats.images.write import write_picture
    from viewer.app.picture_files import export_picture, shot_of
    from viewer.display.offscreen import OffscreenScene

    with OffscreenScene(backend.value) as viewer:
        if ui and viewer.gl.backend == "osmesa":
            raise InputError("--ui: the panels cannot be drawn through OSMesa; use EGL (install libegl1), or no --ui")
        with show_progress("reading"):
            scene = viewer.open(
                shot.source, shot.depth_strength, shot.edits, lambda scene: _pictures_of(scene, shot, viewer, ui)
            )
            size = _size_of(shot, viewer)
            saved = shot_of(viewer.state, size or scene.size, shot.form)
        with show_progress("drawing"):
            if ui:
                pixels = viewer.screen(shot.size or SCREEN_SIZE)
            else:
                pixels = viewer.picture(size, is_float(output, shot.form), saved.color_space)
    if ui:
        write_picture(output, pixels)
    else:
        export_picture(output, pixels, saved)
    clamped = shot.lens.notes(viewer.state.optics)
    # Where all of the photo's pixels are drawn, the size of the views does not matter.
    draws_own = not ui and viewer.draws_own_pixels(size)
    notes = tuple(note for note in scene.notes if not (draws_own and note.startswith(MADE_SMALLER)))
    return notes + clamped, scene.depth_origin
