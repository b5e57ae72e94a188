"""`iibr evaluate`: finds scenes, compares views with the true ones, writes the report. Heavy imports wait."""

from __future__ import annotations

import os
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.outputs import check_output_folder
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import part_of_job
from iibr_core.stages import STAGE_NAMES, stages_without
from iibr_core.types import InputError
from viewer.cli.option_records import with_option_records
from viewer.cli.shared_options import DepthModel, Force, MaxPixels, Refine, inputs_of_command, require_model
from viewer.cli.terminal import print_notes, show_progress

if TYPE_CHECKING:
    from iibr_core.evaluation.evaluate import Options
    from iibr_core.evaluation.scenes import DisparityFrom

WORDS: tuple[DisparityFrom, ...] = ("given", "estimate")
"""Origins of disparity that are no file."""


@dataclass(frozen=True)
class _Comparison:
    """The options of a comparison, as typed."""

    disparity: Annotated[
        str,
        typer.Option(
            metavar="given|estimate|FILE",
            help="Disparity of the middle view: the scene's map, the program's estimate from the photo alone, or a file"
            " (px per view step; LLFF: per mean distance of neighbours).",
        ),
    ] = "given"
    depth_model: DepthModel = None
    refine: Refine = True
    views: Annotated[
        int | None, typer.Option(min=1, help="Compare at most so many views of a scene.", show_default="all")
    ] = None
    max_pixels: MaxPixels = None
    lpips: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Add LPIPS, with its alex.pth and torchvision's alexnet-*.pth from a folder.",
            show_default=False,
        ),
    ] = None
    without: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STAGE",
            help=f"Leave out a stage between map and view; may be given several times: {', '.join(STAGE_NAMES)}.",
            show_default=False,
        ),
    ] = None

    def inputs(self) -> tuple[Path, ...]:
        """Return the files and folders that it names."""
        named = (os.path.expanduser(name) for name in (self.disparity, self.depth_model) if name is not None)
        return tuple(Path(name) for name in named if os.path.lexists(name))

    def options(self) -> Options:
        """Return the same for the core. Raises InputError if a stage is unknown, or a model or a map is missing."""
        from iibr_core.evaluation.evaluate import Options
        from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS

        choice = DepthChoice(model=self.depth_model, refine=self.refine)
        require_model(choice)
        try:
            stages = stages_without(self.without or [])
        except InputError as error:
            raise InputError(f"--without {error}") from None
        max_pixels = self.max_pixels or DEFAULT_MAX_PIXELS
        return Options(_disparity_source(self.disparity), choice, max_pixels, self.views, self.lpips, stages)


@with_option_records
def evaluate(
    context: typer.Context,
    datasets: Annotated[
        list[Path],
        typer.Argument(
            metavar="DATASET...",
            help="Folders: HCI, Stanford archive, LLFF, Middlebury, views/v00_u00.png ..., or of such folders.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="DIR", help="Folder for the report (JSON, Markdown, HTML)."),
    ],
    comparison: _Comparison,
    force: Force = False,
) -> None:
    """Compare generated views with true views, beside the unchanged photo, one plane and a plain warp.

    Example: iibr evaluate hci/dino hci/cotton -o report
    """
    require_extra("evaluate", "scipy", "skimage", "jinja2", "flip_evaluator")
    if comparison.lpips is not None:
        require_extra("train", "torch")
    check_output_folder(out, inputs_of_command(context) + comparison.inputs(), force)

    from iibr_core.evaluation.evaluate import evaluate as evaluate_scene
    from iibr_core.evaluation.report import summary_lines, write_report
    from iibr_core.evaluation.scenes import find_scenes

    options = comparison.options()
    scenes = [scene for folder in datasets for scene in find_scenes(folder)]
    results = []
    with show_progress("reading"):
        for number, scene in enumerate(scenes):
            with part_of_job(number, 1, len(scenes)):
                results += evaluate_scene(scene, options)
    write_report(out, results, shlex.join(["iibr", *sys.argv[1:]]))
    for result in results:
        print(summary_lines(result))
    print(out / "index.html")
    print_notes(tuple(f"{result.scene}: {note}" for result in results for note in result.notes))


def _disparity_source(text: str) -> DisparityFrom | Path:
    """Return the origin of disparity. Raises InputError if it is neither a word nor a file."""
    for word in WORDS:
        if text == word:
            return word
    path = Path(text)
    if not path.is_file():
        raise InputError(f"--disparity {text}: is no file; give {', '.join(WORDS)} or a disparity map")
    return path
