"""Messages of commands on stderr: a progress bar during work, notes after success. An error stays the only line."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from iibr_core.depth.choice import DepthOrigin
from iibr_core.remedies import Remedy, with_remedy
from iibr_core.runtime.compiling import watch_compiling
from iibr_core.runtime.time_left import TimeLeft, about_left
from iibr_core.runtime.work import watched

BETTER_DEPTH = (
    "Better: give a depth map with --disparity FILE, or a trained model with --depth-model (`iibr models` lists what is"
    " there)."
)
REMEDIES = {
    Remedy.REPLACE: "give --force to replace it, or choose another name",
    Remedy.PLACE: "write to another place",
    Remedy.SMALLER: "lower --grid, or --max-pixels for a photo",
    Remedy.DEPTH: "get it with `iibr models get NAME`, or give a depth map with --disparity FILE",
    Remedy.DOWNLOAD: "check the network and try again, name a mirror in HF_ENDPOINT, or use an ONNX file of your own",
    Remedy.VIEW_ORDER: (
        "give --order, --grid and --flip, correct the names, or rectify views of cameras that were turned"
    ),
    Remedy.INVERT: "--invert-depth does so",
    Remedy.INVERT_OR_METRIC: "--invert-depth or --metric does so",
    Remedy.STRETCH: "or add --stretch if it shows the whole photo",
}


def words_of(message: Exception | str) -> str:
    """Return an error or a note, with its remedy."""
    return with_remedy(message, REMEDIES)


def print_notes(*notes: str | None, origin: DepthOrigin | None = None) -> None:
    """Print a line for each note and one for the origin of depth, after the results on stdout."""
    better = BETTER_DEPTH if origin is not None and origin.is_poor else None
    sys.stdout.flush()
    for note in filter(None, notes):
        print(f"note: {words_of(note)}", file=sys.stderr)
    if origin is not None:
        print(*filter(None, ("note:", origin.line, better)), file=sys.stderr)


@contextmanager
def show_progress(doing: str, counts: bool = False) -> Iterator[None]:
    """Show the progress that the block reports, see `report_progress`, as a bar. counts: with numbers."""
    if sys.stderr is None or not sys.stderr.isatty():  # a bar would leave empty lines
        yield
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn

    console = Console(stderr=True)
    columns = ("{task.description}", BarColumn(), TaskProgressColumn(), "{task.fields[details]}")
    time_left = TimeLeft()
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(doing, total=None, details="")

        def show(done: float, total: float, now: str = "") -> None:
            left_s = time_left.update(done, total, now)
            numbers = f"{done:.0f} of {total:.0f}" if counts and total else ""
            details = ", ".join(filter(None, (numbers, about_left(left_s) if left_s else "")))
            length = 1.0 if total else None
            bar.update(task, completed=time_left.share, total=length, description=now or doing, details=details)

        with watch_compiling(lambda message: show(0, 0, message)), watched(show):
            yield
