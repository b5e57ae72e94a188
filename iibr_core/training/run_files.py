"""The files of a training run: weights, and beside them a checkpoint and a log. Light: torch is not needed to ask."""

from __future__ import annotations

from pathlib import Path

from iibr_core.formats.outputs import require_file_place
from iibr_core.types import InputError


def checkpoint_path(out: Path) -> Path:
    """Where training towards `out` keeps its newest checkpoint."""
    return out.with_suffix(".checkpoint.safetensors")


def log_path(out: Path) -> Path:
    """Where training towards `out` keeps its log: CSV, one row a step, columns LOG_COLUMNS, losses without lambdas."""
    return out.with_suffix(".csv")


def require_run_files(out: Path, may_replace: bool = True) -> None:
    """Raise InputError where a run cannot write its files: better to know before an hour of training than after it.

    AlreadyThereError where one of them is there and may not be replaced.
    """
    if out.suffix != ".safetensors":
        raise InputError(f"{out}: weights are written as .safetensors; name the file so")
    for path in (out, checkpoint_path(out), log_path(out)):
        require_file_place(path, may_replace=may_replace)
