"""`iibr generate`: the light field of a photo, or pictures of any cameras, on disk."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.formats.light_fields.write import WRITERS, check_light_field, write_light_field
from iibr_core.formats.outputs import check_output_folder
from iibr_core.types import InputError
from viewer.cli import options
from viewer.cli.messages import print_notes, show_progress
from viewer.cli.option_records import flag, option, output_option, with_option_records

NOT_FOR_DENSE_FIELDS = options.NOT_FOR_LIGHT_FIELDS - {"inpaint"} | {
    "disparity", "disparity_scale", "literal", "gloss",
}  # fmt: skip
"""Options that have no meaning for views between those of a light field."""
NOT_FOR_POSES = {"grid", "format", "depth_strength", "focus_disparity", "with_disparity", "gloss"}
"""Options that have a meaning for light fields only."""
VIEW_FILES = r"view_\d{4,5}\.(png|exr)"
"""Regular expression of the files that --poses writes."""


@with_option_records
def generate(
    context: typer.Context,
    path: options.ScenePath,
    output: Annotated[Path, output_option("Folder to write.", "DIR")],
    scene: options.SceneOptions,
    poses: Annotated[
        Path | None,
        option("Cameras that see the photo: poses_bounds.npy, transforms.json or COLMAP's folder.", "FILE"),
    ] = None,
    photo_pose: Annotated[int | None, option("Number of the photo's pose.", "N", "the middle one", min=1)] = None,
    format: Annotated[
        str, option("Layout of the light field.", "|".join(WRITERS), parser=options.name_in(WRITERS))
    ] = "hci",
    gloss: options.GlossFile = None,
    literal: Annotated[
        bool | None,
        option(
            "Take disparity as given, in px per view step, or scale it as the window does.",
            "",
            "literal with --disparity",
            "--literal/--planned",
        ),
    ] = None,
    with_disparity: Annotated[bool, flag("--with-disparity", "Write a disparity map for every view.")] = False,
    force: options.Force = False,
) -> None:
    """Write the light field of a photo, or a denser grid of a light field.

    A map from --disparity is taken as given, in px per view step; other depth gets the parallax of the window.

    Example: iibr generate photo.png --disparity photo.pfm --grid 9 -o field --format hci

    Example: iibr generate photo.png --grid 9 --gloss gloss.toml -o shiny

    With --poses: pictures of any cameras. The photo's depth is fitted to the depths in its pose, if there are any;
    otherwise the nearest point is 1 away. With --literal, disparity is in px per unit of length.

    Example: iibr generate photo.png --poses transforms.json -o pictures
    """
    from viewer.cli import views_on_disk

    if poses is not None:
        options.require_not_given(context, NOT_FOR_POSES, "for light fields only, not for --poses")
        source = scene.source(path)
        check_output_folder(output, options.inputs_of_command(context, source), force, VIEW_FILES)
        write = partial(views_on_disk.write_free_views, source, poses, photo_pose, bool(literal), output)
    else:
        grid = scene.grid
        if grid is None or photo_pose is not None:
            raise InputError("give --grid for a light field, or --poses for pictures of any cameras")
        is_dense = is_light_field(path)
        if is_dense:
            options.require_heeded(context, path, NOT_FOR_DENSE_FIELDS)
        is_literal = not is_dense and (scene.disparity is not None if literal is None else literal)
        source = replace(scene, grid=None if is_dense else grid).source(path, is_literal)
        check_light_field(output, format, options.inputs_of_command(context, source), force)
        write_views = partial(write_light_field, output, format, grid, with_disparity=with_disparity)
        write = (
            partial(views_on_disk.write_dense_field, source, grid, write_views)
            if is_dense
            else partial(views_on_disk.write_field, source, write_views, scene.depth_strength, options.gloss_of(gloss))
        )
    options.require_source(source)
    start = time.perf_counter()
    with show_progress("reading"):
        written = write()
    print(f"{written.views} in {time.perf_counter() - start:.1f} s: {output}")
    print_notes(*written.notes, origin=written.origin)
