"""Runs `iibr` in forks of one process that has imported it already: they start in no time."""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Mapping
from pathlib import Path

PRELOADED = (
    "viewer.entry",
    "viewer.cli.main",
    "viewer.app.headless",
    "iibr_core.scenes.loaded_photo",
    "iibr_core.depth.search",
    "iibr_core.generation.light_field",
    "iibr_core.formats.light_fields.hci",
    "iibr_core.evaluation.protocol",
)
KILLED = 137


def run_in_fork(
    arguments: tuple[str, ...], work: Path, environment: Mapping[str, str], told: Path, deadline_s: float
) -> int:
    """Run a command in a folder, its standard output and error written into the folder `told`; its exit code."""
    forks = multiprocessing.get_context("forkserver")
    forks.set_forkserver_preload(list(PRELOADED))
    process = forks.Process(target=_become_command, args=(arguments, work, dict(environment), told), daemon=True)
    process.start()
    process.join(deadline_s)
    if process.exitcode is None:
        process.kill()
        return KILLED
    # Written by the process itself: threads that start others may have taken the exit code for themselves.
    code = told / "code"
    return int(code.read_text()) if code.exists() else process.exitcode


def _become_command(arguments: tuple[str, ...], work: Path, environment: dict[str, str], told: Path) -> None:
    for descriptor, name in ((0, os.devnull), (1, told / "output"), (2, told / "errors")):
        opened = os.open(name, os.O_RDONLY if descriptor == 0 else os.O_WRONLY | os.O_CREAT)
        os.dup2(opened, descriptor)
    sys.stdin = os.fdopen(0, closefd=False)
    sys.stdout, sys.stderr = (os.fdopen(descriptor, "w", encoding="utf-8", closefd=False) for descriptor in (1, 2))
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(work)
    sys.argv = ["iibr", *arguments]
    from viewer.entry import main

    try:
        main()
    except SystemExit as ending:
        (told / "code").write_text(str(ending.code or 0))
        raise
