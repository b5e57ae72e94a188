"""The files of a training run: weights, and beside them a checkpoint and a log. Light: torch is not needed to ask."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from iibr_core.formats.files import is_file
from iibr_core.formats.outputs import check_output, write_file
from iibr_core.types import InputError


class LogRow(NamedTuple):
    """What the log tells of a step."""

    step: int
    total: float
    color: float
    entropy: float
    epi: float
    gradient_norm: float
    learning_rate: float
    seconds: float


def checkpoint_path(out: Path) -> Path:
    """Where training towards `out` keeps its newest checkpoint."""
    return out.with_suffix(".checkpoint.safetensors")


def log_path(out: Path) -> Path:
    """Where training towards `out` keeps its log: CSV, one row a step, columns as in LogRow, losses without lambdas."""
    return out.with_suffix(".csv")


def require_run_files(out: Path, may_replace: bool = True) -> None:
    """Raise InputError where a run cannot write its files: better to know before an hour of training than after it.

    AlreadyThereError where one of them is there and may not be replaced.
    """
    if out.suffix != ".safetensors":
        raise InputError(f"{out}: weights are written as .safetensors; name the file so")
    for path in (out, checkpoint_path(out), log_path(out)):
        check_output(path, may_replace=may_replace)


@contextmanager
def training_log(path: Path, done: int) -> Iterator[Callable[[LogRow], None]]:
    """Yield what writes a row. Rows up to step `done` of the log that is there stay, what came after them goes.

    A log without any row is removed again. Raises InputError where it cannot be written.
    """
    rows = path.read_text(errors="replace").splitlines() if done and is_file(path) else []
    kept = [row for row in rows if row.count(",") == len(LogRow._fields) - 1 and _step_of(row) <= done]
    with write_file(path) as temporary:
        temporary.write_text("".join(line + "\n" for line in [",".join(LogRow._fields), *kept]))
    is_empty = not kept

    def write_row(row: LogRow) -> None:
        nonlocal is_empty
        try:
            with path.open("a") as file:
                file.write(",".join(f"{value:.9g}" for value in row) + "\n")
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror}); make room, or choose another") from error
        is_empty = False

    try:
        yield write_row
    finally:
        if is_empty:
            path.unlink(missing_ok=True)


def _step_of(row: str) -> float:
    step = row.split(",")[0]
    return int(step) if step.isdecimal() else float("inf")
