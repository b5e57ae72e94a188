"""`iibr depth`: the disparity of a light field's or stereo pair's views, found from the views."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from viewer.cli.shared_options import Force, Memory, inputs_of_command, require_memory
from viewer.cli.terminal import print_notes, show_progress


def depth(
    context: typer.Context,
    field: Annotated[Path, typer.Argument(metavar="PATH", help="A light field, or a stereo photo.")],
    out: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Map to write: PFM, EXR, NPY or PNG.")],
    memory: Memory = None,
    force: Force = False,
) -> None:
    """Find the disparity of the centre view, of a pair the left one, from all views, in pixels per view step.

    Example: iibr depth field -o field_disparity.pfm
    """
    require_memory(memory, keeps_views=True)
    from iibr_core.formats import open_light_field, require_file_place, write_map
    from iibr_core.generation import budget_of
    from iibr_core.scenes import find_disparity

    require_file_place(out, inputs_of_command(context), force)
    scene = open_light_field(field)
    with show_progress("reading") as show:
        values = find_disparity(scene, budget_of(memory), show)
    note = write_map(out, values)
    print(f"{scene.name}: disparity {values.min():.2f} to {values.max():.2f} px per view step: {out}")
    print_notes((note,) if note else ())
