"""`iibr generate`: the light field of a photo, or pictures of any cameras, on disk."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.formats.light_fields.write import WRITERS, check_light_field, write_light_field
from iibr_core.formats.outputs import check_output_folder
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError
from viewer.cli.lens_options import GlossFile, gloss_of
from viewer.cli.option_records import with_option_records
from viewer.cli.options import (
    NOT_FOR_LIGHT_FIELDS,
    Force,
    SceneOptions,
    ScenePath,
    given_options,
    grid_from_text,
    inputs_of_command,
    name_in,
    require_heeded,
    require_source,
    words_of_options,
)
from viewer.cli.progress import print_notes, show_progress

NOT_FOR_DENSE_FIELDS = NOT_FOR_LIGHT_FIELDS - {"grid", "inpaint"} | {"disparity", "disparity_scale", "literal", "gloss"}
"""Options that have no meaning for views between those of a light field."""
NOT_FOR_POSES = {"grid", "format", "depth_strength", "with_disparity", "gloss"}
"""Options that have a meaning for light fields only."""
VIEW_FILES = r"view_\d{4,5}\.(png|exr)"
"""Regular expression of the files that --poses writes."""


@with_option_records
def generate(
    context: typer.Context,
    path: ScenePath,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to write.")],
    scene: SceneOptions,
    grid: Annotated[
        GridShape | None,
        typer.Option(parser=grid_from_text, metavar="N|RxC", help="Grid of views: 9 is 9x9.", show_default=False),
    ] = None,
    poses: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Cameras that see the photo: poses_bounds.npy, transforms.json or COLMAP's folder.",
            show_default=False,
        ),
    ] = None,
    photo_pose: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Number of the photo's pose.", show_default="the middle one"),
    ] = None,
    format: Annotated[
        str, typer.Option(parser=name_in(WRITERS), metavar="|".join(WRITERS), help="Layout of the light field.")
    ] = "hci",
    gloss: GlossFile = None,
    literal: Annotated[
        bool | None,
        typer.Option(
            "--literal/--planned",
            help="Take disparity as given, in px per view step, or scale it as the window does.",
            show_default="literal with --disparity",
        ),
    ] = None,
    with_disparity: Annotated[
        bool, typer.Option("--with-disparity", help="Write a disparity map for every view.")
    ] = False,
    force: Force = False,
) -> None:
    """Write the light field of a photo, or a denser grid of a light field.

    A map given by --disparity is used unchanged, in px per view step. Other depth gets the parallax that the window
    shows.

    Example: iibr generate photo.png --disparity photo.pfm --grid 9 -o field --format hci

    Example: iibr generate photo.png --grid 9 --gloss gloss.toml -o shiny

    With --poses: pictures of any cameras. The photo's depth is fitted to the depths of its pose; without these, the
    nearest point is 1 away. With --literal, disparity is in px per unit of length.

    Example: iibr generate photo.png --poses transforms.json -o pictures
    """
    from viewer.cli.views_on_disk import write_dense_field, write_field, write_free_views

    if poses is not None:
        source = _source_of_poses(context, scene, path, output, force)
        with show_progress("reading"):
            written = write_free_views(source, poses, photo_pose, bool(literal), output)
    else:
        if grid is None or photo_pose is not None:
            raise InputError("give --grid for a light field, or --poses for pictures of any cameras")
        is_dense = is_light_field(path)
        if is_dense:
            require_heeded(context, path, NOT_FOR_DENSE_FIELDS)
        source = scene.source(path, grid, is_literal=scene.disparity is not None if literal is None else literal)
        check_light_field(output, format, inputs_of_command(context, source), force)
        require_source(source)
        write = partial(write_light_field, output, format, grid, with_disparity=with_disparity)
        with show_progress("reading"):
            if is_dense:
                written = write_dense_field(source, grid, write)
            else:
                written = write_field(source, write, scene.depth_strength, gloss_of(gloss))
    print(f"{written.summary}: {output}")
    print_notes(written.notes, written.origin)


def _source_of_poses(
    context: typer.Context, scene: SceneOptions, path: Path, folder: Path, may_replace: bool
) -> Source:
    """Return the photo of poses. Raises InputError if an option has no meaning for them, or the folder is refused."""
    unused = given_options(context) & NOT_FOR_POSES
    if unused:
        raise InputError(f"{words_of_options(context, unused)}: for light fields only; leave it out with --poses")
    source = scene.source(path, None)
    check_output_folder(folder, inputs_of_command(context, source), may_replace, VIEW_FILES)
    require_source(source)
    return source
