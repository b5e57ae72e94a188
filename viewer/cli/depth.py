"""`iibr depth`: write the disparity of a light field, a stereo photo or a photo."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.formats.light_fields.light_field_formats import find_light_field
from iibr_core.formats.light_fields.order import Arrangement
from iibr_core.formats.outputs import check_output
from iibr_core.scenes.scene import Source
from viewer.cli.messages import print_notes, show_progress
from viewer.cli.option_records import output_option, with_option_records
from viewer.cli.options import (
    DepthOptions,
    Force,
    Grid,
    RightPath,
    ViewFlip,
    ViewOrder,
    inputs_of_command,
    require_heeded,
    require_model,
    with_arrangement,
)


@with_option_records
def depth(
    context: typer.Context,
    path: Annotated[Path, typer.Argument(metavar="PATH", help="A light field, a stereo photo, or any photo.")],
    output: Annotated[Path, output_option("Map to write: PFM, EXR, NPY or PNG.")],
    options: DepthOptions,
    right: RightPath = None,
    order: ViewOrder = None,
    grid: Grid = None,
    flip: ViewFlip = None,
    force: Force = False,
) -> None:
    """Write the disparity of the centre view, in pixels per view step; of a stereo photo, that of the left view.

    For light fields and stereo photos, it is found from all views. For photos, and stereo photos with --depth or
    --depth-model, it is that of a map beside the photo, one in it, a model's estimate, or a guess.

    Example: iibr depth photo.jpg -o photo_disparity.png
    """
    choice = replace(options.choice, right=None if right is None else str(right))
    source = with_arrangement(Source(str(path), choice), Arrangement(order, grid, flip))
    require_heeded(context, path)
    check_output(output, inputs_of_command(context, source), force)
    require_model(source.depth)
    from iibr_core.formats.maps.writer import write_map
    from iibr_core.scenes.light_fields import find_disparity
    from iibr_core.scenes.photo import load_photo

    notes: tuple[str, ...] = ()
    origin = None
    with show_progress("reading"):
        if path.is_file() and (source.depth.start != "auto" or right is not None or find_light_field(path) is None):
            loaded = load_photo(source)
            name, origin = loaded.photo.name, loaded.origin
            values, notes = loaded.disparity.values, loaded.disparity.notes
        else:
            name, values, notes = find_disparity(source)
    note = write_map(output, values)
    print(f"{name}: disparity {values.min():.2f} to {values.max():.2f} px per view step: {output}")
    print_notes(*notes, note, origin=origin)
