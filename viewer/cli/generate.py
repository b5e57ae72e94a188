"""`iibr generate`: the light field of a photo, on disk."""

from __future__ import annotations

import math
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.formats.light_fields.write import check_light_field, write_light_field
from iibr_core.gloss.settings import Gloss
from iibr_core.types import GridShape, InputError
from viewer.cli.dense_field_command import NOT_FOR_DENSE_FIELDS, write_dense_field
from viewer.cli.free_views_command import (
    require_heeded_with_poses,
    require_poses_for,
    require_views_folder,
    write_free_views,
)
from viewer.cli.lens_options import GlossFile
from viewer.cli.option_records import with_option_records
from viewer.cli.scene_options import SceneOptions, require_heeded
from viewer.cli.shared_options import (
    Force,
    LightFieldFormat,
    PhotoPose,
    PosesFile,
    ScenePath,
    grid_from_text,
    inputs_of_command,
    require_existing,
    require_model,
)
from viewer.cli.terminal import print_depth, print_notes, show_progress
from viewer.cli.view_writing import write_views

if TYPE_CHECKING:
    from iibr_core.scenes.scene import Source


@with_option_records
def generate(
    context: typer.Context,
    path: ScenePath,
    out: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to write.", show_default=False)],
    scene: SceneOptions,
    grid: Annotated[
        GridShape | None,
        typer.Option(parser=grid_from_text, metavar="N|RxC", help="Views to make: 9 is 9x9.", show_default=False),
    ] = None,
    poses: PosesFile = None,
    photo_pose: PhotoPose = None,
    format: LightFieldFormat = "hci",
    gloss: GlossFile = None,
    literal: Annotated[
        bool | None,
        typer.Option(
            "--literal/--planned",
            help="Disparity counts as given, in px from view to view, or as the window shows it.",
            show_default="literal with --disparity",
        ),
    ] = None,
    with_disparity: Annotated[bool, typer.Option("--with-disparity", help="A disparity map for every view.")] = False,
    force: Force = False,
) -> None:
    """Write the light field of a photo: a disparity map that is named counts as it is, in px from view to view; found
    or estimated depth gets the parallax that the window shows. Of a light field: its views and those between.

    Example: iibr generate photo.png --disparity photo.pfm --grid 9 -o field --format hci

    Example: iibr generate photo.png --grid 9 --gloss gloss.toml -o shiny

    With --poses: the pictures of any cameras; the photo's depth is fitted to the depths of its pose, else the nearest
    is 1 away (--literal: disparity counts as it is, in px per unit of length).

    Example: iibr generate photo.png --poses transforms.json -o pictures
    """
    require_poses_for(photo_pose, poses)
    if poses is not None:
        if grid is not None:
            raise InputError("--grid makes a light field, --poses pictures of any cameras: give one of them")
        _generate_from_poses(context, scene.source(path, None), poses, photo_pose, bool(literal), out, force)
        return
    if grid is None:
        raise InputError("give --grid, for a light field, or --poses, for pictures of any cameras")
    is_dense = is_light_field(path)
    if is_dense:
        require_heeded(context, path, NOT_FOR_DENSE_FIELDS)
    source = scene.source(path, grid, is_literal=scene.disparity is not None if literal is None else literal)
    require_existing(source)
    check_light_field(out, format, inputs_of_command(context, source), force)
    if is_dense:
        write_dense_field(source, grid, out, format, with_disparity)
    else:
        _write_light_field(
            source, grid, out, format, scene.depth_strength, gloss.gloss if gloss else None, with_disparity
        )


def _generate_from_poses(
    context: typer.Context,
    source: Source,
    poses: Path,
    photo_pose: int | None,
    is_literal: bool,
    out: Path,
    may_replace: bool,
) -> None:
    require_heeded_with_poses(context)
    require_existing(source)
    require_views_folder(out, inputs_of_command(context, source), may_replace)
    write_free_views(source, poses, photo_pose, is_literal, out)


def _write_light_field(
    source: Source,
    grid: GridShape,
    out: Path,
    layout: str,
    depth_strength: float,
    gloss: Gloss | None,
    with_disparity: bool,
) -> None:
    require_model(source.depth)

    from iibr_core.scenes.opening import scene_of_photo
    from iibr_core.scenes.photo import load_photo, make_plan, views_of_photo
    from iibr_core.scenes.scene_gloss import add_gloss

    with show_progress("reading"):
        loaded = load_photo(source)
        plan = make_plan(source, loaded, depth_strength, keeps_views=False)
        write = partial(
            write_light_field,
            out,
            layout,
            grid,
            focal_px=loaded.photo.focal_px,
            name=loaded.photo.name,
            with_disparity=with_disparity,
        )
        with closing(views_of_photo(source, loaded, plan)) as made:
            views = add_gloss(made, gloss, scene_of_photo(source, loaded, plan))
            summary = write_views(views, write, loaded.photo.size, math.prod(grid))
    print(f"{summary}: {out}")
    print_notes(loaded.photo.notes + loaded.disparity.notes + plan.notes)
    print_depth(loaded.origin)
