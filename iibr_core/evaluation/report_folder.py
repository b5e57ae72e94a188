"""Where a report goes; light, so that this can be asked before anything else is loaded."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from iibr_core.formats.outputs import check_output_folder

FILES = ("report.json", "report.md", "index.html")


def require_report_folder(folder: Path, inputs: Iterable[Path] = (), may_replace: bool = True) -> None:
    """Raise InputError where reports cannot be written, before hours are spent on figures.

    inputs: files and folders that are read. AlreadyThereError where something lies in the folder that may not be
    replaced.
    """
    check_output_folder(folder, inputs, may_replace)
