"""`iibr evaluate`: finds scenes, judges them, writes the report. Heavy imports wait."""

from __future__ import annotations

import os
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.files import is_file
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import part_of_job
from iibr_core.stages import STAGE_NAMES, stages_without
from iibr_core.types import InputError
from viewer.cli.option_records import with_option_records
from viewer.cli.shared_options import (
    DepthModel,
    Force,
    MaxPixels,
    Refine,
    inputs_of_command,
    require_model,
)
from viewer.cli.terminal import print_notes, show_progress

if TYPE_CHECKING:
    from iibr_core.evaluation.evaluate_scene import Options
    from iibr_core.evaluation.trials import DisparityFrom
    from iibr_core.stages import Stages


@dataclass(frozen=True)
class _Judging:
    """How views are judged, as typed."""

    disparity: Annotated[
        str,
        typer.Option(
            metavar="auto|gt|estimate|FILE",
            help="Of the given view: the data set's (gt), estimated from the photo, a file (px per view step; LLFF: per"
            " mean distance of neighbours); auto: gt if there is one.",
        ),
    ] = "auto"
    depth_model: DepthModel = None
    refine: Refine = True
    views: Annotated[
        int | None, typer.Option(min=1, help="Judge at most so many views of a scene.", show_default="all")
    ] = None
    max_pixels: MaxPixels = None
    lpips: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="LPIPS too: its alex.pth and torchvision's alexnet-*.pth.", show_default=False
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
        """The files it names; else they are words, and names of models."""
        named = (os.path.expanduser(name) for name in (self.disparity, self.depth_model) if name is not None)
        return tuple(Path(name) for name in named if os.path.lexists(name))

    def options(self, stages: Stages) -> Options:
        """The same as a record of the core. Raises InputError for a model or a map that is not there."""
        from iibr_core.evaluation.evaluate_scene import Options
        from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS

        choice = DepthChoice(model=self.depth_model, refine=self.refine)
        require_model(choice)
        max_pixels = self.max_pixels or DEFAULT_MAX_PIXELS
        source = _disparity_source(self.disparity)
        return Options(source, choice, max_pixels, self.views, self.lpips, stages=stages)


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
    judging: _Judging,
    force: Force = False,
) -> None:
    """Judge views against data sets whose true views are known, beside a plain warp and beside doing nothing.

    Example: iibr evaluate hci/dino hci/cotton -o report
    """
    stages = _stages_without(judging.without or [])
    require_extra("evaluate", "scipy", "skimage", "jinja2", "flip_evaluator")
    if judging.lpips is not None:
        require_extra("train", "torch")
    from iibr_core.evaluation.report_folder import require_report_folder

    require_report_folder(out, inputs_of_command(context) + judging.inputs(), force)

    from iibr_core.evaluation.datasets import find_scenes
    from iibr_core.evaluation.evaluate_scene import evaluate as evaluate_scene
    from iibr_core.evaluation.evaluation_report import write_report
    from iibr_core.evaluation.tables import summary_line

    options = judging.options(stages)
    scenes = [scene for folder in datasets for scene in find_scenes(folder)]
    results = []
    with show_progress("reading"):
        for number, scene in enumerate(scenes):
            with part_of_job(number, 1, len(scenes)):
                results += evaluate_scene(scene, options)
    write_report(out, results, shlex.join(["iibr", *sys.argv[1:]]))
    for result in results:
        print(summary_line(result))
    notes = dict.fromkeys(f"{result.scene}: {note}" for result in results for note in result.notes)
    print(out / "index.html")
    print_notes(tuple(notes))


def _stages_without(names: list[str]) -> Stages:
    """Raises InputError, which names the option."""
    try:
        return stages_without(names)
    except InputError as error:
        raise InputError(f"--without {error}") from None


def _disparity_source(text: str) -> DisparityFrom | Path:
    """Where disparity comes from. Raises InputError for what is neither a word nor a file."""
    from iibr_core.evaluation.trials import DisparityFrom

    words: tuple[DisparityFrom, ...] = get_args(DisparityFrom)
    for word in words:
        if text == word:
            return word
    path = Path(text)
    if not is_file(path):
        raise InputError(f"--disparity {text}: is no file; give {', '.join(words)} or a disparity map")
    return path
