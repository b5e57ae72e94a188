"""`iibr depth`: the disparity of a light field or stereo pair, found from the views; of a photo, as it opens."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.formats.light_fields.light_field_formats import find_light_field, open_light_field
from iibr_core.formats.outputs import check_output
from viewer.cli.scene_options import PhotoOptions, require_heeded
from viewer.cli.shared_options import (
    DepthFrom,
    DepthModel,
    Force,
    InvertDepth,
    Metric,
    Refine,
    inputs_of_command,
    require_model,
)
from viewer.cli.terminal import print_depth, print_notes, show_progress


def depth(
    context: typer.Context,
    path: Annotated[Path, typer.Argument(help="A light field, a stereo photo, or any photo.")],
    out: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Map to write: PFM, EXR, NPY or PNG.")],
    depth_from: DepthFrom = "auto",
    depth_model: DepthModel = None,
    refine: Refine = True,
    invert_depth: InvertDepth = False,
    metric: Metric = False,
    force: Force = False,
) -> None:
    """Find the disparity of the centre view, of a pair the left one, from all views, in pixels per view step.

    Of a photo, also of a pair where --depth or --depth-model is given, it is what it opens with: a map beside it, its
    own, a model's, or a guess.

    Example: iibr depth photo.jpg -o photo_disparity.png
    """
    options = PhotoOptions(depth_from, depth_model, refine, invert_depth=invert_depth, metric=metric)
    source = options.source(path, grid=None)
    require_heeded(context, path)
    from iibr_core.formats.maps.writer import write_map
    from iibr_core.scenes.light_fields import find_disparity
    from iibr_core.scenes.photo import load_photo

    check_output(out, inputs_of_command(context, source), force)
    require_model(source.depth)
    if path.is_file() and (source.depth.start != "auto" or find_light_field(path) is None):
        loaded = load_photo(source)
        name, values, notes = loaded.photo.name, loaded.disparity.values, loaded.disparity.notes
        origin = loaded.origin
    else:
        scene = open_light_field(path)
        with show_progress("reading"):
            name, values, notes = scene.name, find_disparity(scene), ()
        origin = None
    note = write_map(out, values)
    print(f"{name}: disparity {values.min():.2f} to {values.max():.2f} px per view step: {out}")
    print_depth(origin)
    print_notes((*notes, *((note,) if note else ())))
