"""`iibr` in a fork of a process that has imported it: as in a process of its own, but for how Python starts."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

from tests.hostile.forks import Command, run_in_fork

DEADLINE_S = 120.0
NO_WINDOWS = ("DISPLAY", "WAYLAND_DISPLAY")


def run_forked(*words: object, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """How it ended, without a display."""
    clean = {name: value for name, value in os.environ.items() if name not in NO_WINDOWS}
    arguments = tuple(map(str, words))
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder)
        code = run_in_fork(Command(arguments, cwd, {**clean, **environment}, told), DEADLINE_S)
        output, errors = ((told / name).read_text("utf-8") for name in ("output", "errors"))
    return subprocess.CompletedProcess(["iibr", *arguments], code, output, errors)
