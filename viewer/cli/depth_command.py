"""`iibr depth`: the disparity of a light field or stereo pair, found from the views; of a photo, as it opens."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from viewer.cli.shared_options import Force, Memory, inputs_of_command, require_memory
from viewer.cli.terminal import print_depth, print_notes, show_progress


def depth(
    context: typer.Context,
    field: Annotated[Path, typer.Argument(metavar="PATH", help="A light field, a stereo photo, or any photo.")],
    out: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Map to write: PFM, EXR, NPY or PNG.")],
    memory: Memory = None,
    force: Force = False,
) -> None:
    """Find the disparity of the centre view, of a pair the left one, from all views, in pixels per view step.

    Of a photo it is what it opens with: a map beside it, its own, a model's, or a guess.

    Example: iibr depth field -o field_disparity.pfm
    """
    require_memory(memory, keeps_views=True)
    from iibr_core.formats import find_light_field, is_file, open_light_field, require_file_place, write_map
    from iibr_core.generation import budget_of
    from iibr_core.scenes import find_disparity

    require_file_place(out, inputs_of_command(context), force)
    if is_file(field) and find_light_field(field) is None:
        _write_of_photo(field, out, memory)
        return
    scene = open_light_field(field)
    with show_progress("reading") as show:
        values = find_disparity(scene, budget_of(memory), show)
    note = write_map(out, values)
    print(f"{scene.name}: disparity {values.min():.2f} to {values.max():.2f} px per view step: {out}")
    print_notes((note,) if note else ())


def _write_of_photo(photo: Path, out: Path, memory: int | None) -> None:
    from iibr_core.depth import DepthChoice
    from iibr_core.formats import write_map
    from iibr_core.scenes import Source, load_photo

    loaded = load_photo(Source(str(photo), DepthChoice(memory_bytes=memory)))
    values = loaded.disparity.values
    note = write_map(out, values)
    print(f"{loaded.photo.name}: disparity {values.min():.2f} to {values.max():.2f} px per view step: {out}")
    print_depth(loaded.origin)
    print_notes((*loaded.disparity.notes, *((note,) if note else ())))
