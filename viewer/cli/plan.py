"""`iibr plan`: the plan of a photo in words, or what a folder or file of views was recognised as."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.scenes.scene import Source
from viewer.cli.messages import words_of
from viewer.cli.option_records import with_option_records
from viewer.cli.options import SceneOptions, require_heeded


@with_option_records
def plan(
    context: typer.Context,
    path: Annotated[Path, typer.Argument(metavar="PATH", help="A photo, or a folder or file of views.")],
    scene: SceneOptions,
) -> None:
    """Show grid, parallax and memory planned for a photo, without making views; of views, what they are recognised as.

    Example: iibr plan photo.png --disparity photo.pfm
    """
    source = scene.source(path)
    require_heeded(context, path)
    first, *reasons = _lines_of_views(source) if is_light_field(path) else _lines_of_photo(source, scene.depth_strength)
    print(first)
    for line in reasons:
        print(f"- {words_of(line)}")


def _lines_of_photo(source: Source, depth_strength: float) -> list[str]:
    """Return the name, size and source of depth of a photo, then the reasons of its plan."""
    from iibr_core.scenes.photo import load_photo, make_plan

    loaded = load_photo(source)
    chosen = make_plan(source, loaded, depth_strength)
    first = f"{loaded.photo.name}: {loaded.photo.size} px, disparity from {loaded.disparity.source}"
    return [first, *chosen.reasons, *loaded.photo.notes, *loaded.disparity.notes]


def _lines_of_views(source: Source) -> list[str]:
    """Return the name, layout and source of disparity of a light field, then the facts about its views."""
    from iibr_core.formats.light_fields.multi_view_scene import common_size
    from iibr_core.formats.light_fields.views import disparity_range
    from iibr_core.formats.maps.disparity_file import read_disparity
    from iibr_core.method.memory import mebibytes, view_bytes
    from iibr_core.scenes.light_fields import open_settled

    field, notes = open_settled(source)
    size, file, count = common_size(field.views), source.depth.file, len(field.views)
    place, range_px = f"{count} views, which fill no regular grid: only `iibr evaluate` reads them", field.range_px
    if field.grid is not None:
        place, range_px = f"Views: {field.grid.columns} across, {field.grid.rows} down", disparity_range(field)
    if file is not None:
        values = read_disparity(Path(file), size, source.depth.file_scale or 1.0).values
        origin, range_px = Path(file).name, (float(values.min()), float(values.max()))
    elif field.disparity:
        origin = f"the maps of {len(field.disparity)} of {count} views"
    else:
        origin = "the views themselves, when they are opened" if field.grid else "no map"
    lines = [f"{field.name}: {field.layout}, {size} px a view, disparity from {origin}", f"{place}."]
    if range_px is not None:
        lines.append("Disparity goes from {:.2f} to {:.2f} px per view step.".format(*range_px))
    memory = mebibytes(view_bytes(math.prod(size) * count, field.is_hdr))
    return [*lines, f"Memory: {memory} for the views.", *notes]
