"""`iibr generate FIELD --grid N`: the views of a light field and those between them, on disk."""

from __future__ import annotations

import math
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.write import write_light_field
from iibr_core.types import GridShape, image_size
from viewer.cli.scene_options import NOT_FOR_LIGHT_FIELDS
from viewer.cli.terminal import print_notes, show_progress
from viewer.cli.view_writing import write_views

if TYPE_CHECKING:
    from iibr_core.scenes.scene import Source

NOT_FOR_DENSE_FIELDS = NOT_FOR_LIGHT_FIELDS - {"grid", "inpaint"} | {"disparity", "disparity_scale", "literal", "gloss"}
"""Options that say nothing about views between those of a light field."""


def write_dense_field(source: Source, grid: GridShape, out: Path, layout: str, with_disparity: bool) -> None:
    """Write a light field's views and those between. Raises InputError if the views have no places on the grid."""
    from iibr_core.scenes.light_fields import read_dense

    field = open_light_field(Path(source.path))
    with show_progress("reading"):
        given, _, all_views = read_dense(field, grid, source.inpaint)
        size = image_size(given[0].colors)
        write = partial(
            write_light_field,
            out,
            layout,
            grid,
            focal_px=field.focal_px or float(size.width),
            name=field.name,
            with_disparity=with_disparity,
        )
        with closing(all_views) as views:
            summary = write_views(views, write, size, math.prod(grid))
    print(f"{summary}: {out}")
    print_notes(field.notes)
