"""`iibr evaluate`: compare generated views with true ones and write a report."""

from __future__ import annotations

import os
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.outputs import check_output_folder
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import part_of_job
from iibr_core.stages import STAGE_NAMES, stages_without
from iibr_core.types import InputError
from viewer.cli.messages import print_notes, show_progress
from viewer.cli.option_records import option, output_option, with_option_records
from viewer.cli.options import DepthModel, Force, MaxPixels, Refine, inputs_of_command, require_model

DISPARITY = (
    "Disparity of the middle view: the scene's map, an estimate from the photo alone, or a file (px per view step;"
    " LLFF: per mean distance of neighbours)."
)
DATASETS = "Folders: HCI, Stanford archive, LLFF, Middlebury, views/v00_u00.png ..., or of such folders."
LPIPS = "Add LPIPS, with its alex.pth and torchvision's alexnet-*.pth from a folder."
WITHOUT = f"Leave out a stage between map and view; repeat it for more: {', '.join(STAGE_NAMES)}."


@dataclass(frozen=True)
class ComparisonOptions:
    """Options of a comparison."""

    disparity: Annotated[str, option(DISPARITY, "given|estimate|FILE")] = "given"
    depth_model: DepthModel = None
    refine: Refine = "on"
    views: Annotated[int | None, option("Compare at most N views of a scene.", "N", "all", min=1)] = None
    max_pixels: MaxPixels = None
    lpips: Annotated[Path | None, option(LPIPS, "DIR")] = None
    without: Annotated[list[str] | None, option(WITHOUT, "STAGE")] = None

    def inputs(self) -> tuple[Path, ...]:
        """Return the files and folders that are named as text."""
        named = (os.path.expanduser(name) for name in (self.disparity, self.depth_model) if name is not None)
        return tuple(Path(name) for name in named if os.path.lexists(name))

    def source(self) -> Literal["given", "estimate"] | Path:
        """Return the origin of disparity. Raises InputError if the map does not exist."""
        if self.disparity == "given":
            return "given"
        if self.disparity == "estimate":
            return "estimate"
        if not Path(self.disparity).is_file():
            raise InputError(f"--disparity {self.disparity}: no such file; give a map, given or estimate")
        return Path(self.disparity)


@with_option_records
def evaluate(
    context: typer.Context,
    datasets: Annotated[list[Path], typer.Argument(metavar="DATASET", help=DATASETS)],
    output: Annotated[Path, output_option("Folder for the report (JSON, Markdown, HTML).", "DIR")],
    comparison: ComparisonOptions,
    force: Force = False,
) -> None:
    """Compare generated views with true views, a plain warp, one plane and the unchanged photo.

    Example: iibr evaluate hci/dino hci/cotton -o report
    """
    require_extra("evaluate", "scipy", "skimage", "jinja2", "flip_evaluator")
    if comparison.lpips is not None:
        require_extra("train", "torch")
    check_output_folder(output, inputs_of_command(context) + comparison.inputs(), force)

    from iibr_core.evaluation import evaluate as evaluation
    from iibr_core.evaluation.report import summary_lines, write_report
    from iibr_core.evaluation.scenes import find_scenes
    from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS

    choice = DepthChoice(model=comparison.depth_model, refine=comparison.refine == "on")
    require_model(choice)
    max_pixels, stages = comparison.max_pixels or DEFAULT_MAX_PIXELS, stages_without(comparison.without or [])
    options = evaluation.Options(comparison.source(), choice, max_pixels, comparison.views, comparison.lpips, stages)
    scenes = [scene for folder in datasets for scene in find_scenes(folder)]
    results = []
    with show_progress("reading"):
        for number, scene in enumerate(scenes):
            with part_of_job(number, 1, len(scenes)):
                results += evaluation.evaluate(scene, options)
    write_report(output, results, shlex.join(["iibr", *sys.argv[1:]]))
    for result in results:
        print(summary_lines(result))
    print(output / "index.html")
    print_notes(*(f"{result.scene}: {note}" for result in results for note in result.notes))
