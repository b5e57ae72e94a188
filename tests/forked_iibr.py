"""Run `iibr` in a fork of a process that has imported it: like a process of its own, but it starts at once."""

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

PRELOADED = (
    "viewer.cli.main",
    "viewer.display.offscreen",
    "iibr_core.depth.search",
    "iibr_core.method.light_field",
    "iibr_core.evaluation.evaluate",
)
DEADLINE_S = 120.0
NO_WINDOWS = ("DISPLAY", "WAYLAND_DISPLAY")


def run_forked(
    *words: object, cwd: Path, max_bytes: int | None = None, typed: str = "", **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run `iibr` without a display.

    max_bytes: largest file that it can write, as on a full disk. typed: text on its standard input.
    """
    clean = {name: value for name, value in os.environ.items() if name not in NO_WINDOWS}
    arguments = [str(word) for word in words]
    forks = multiprocessing.get_context("forkserver")
    forks.set_forkserver_preload(list(PRELOADED))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "input").write_text(typed)
        process = forks.Process(
            target=_become_iibr, args=(arguments, cwd, {**clean, **environment}, Path(folder), max_bytes), daemon=False
        )
        process.start()
        process.join(DEADLINE_S)
        if process.exitcode is None:
            process.kill()
            process.join()
        output, errors = ((Path(folder) / name).read_text("utf-8") for name in ("output", "errors"))
    return subprocess.CompletedProcess(["iibr", *arguments], process.exitcode or 0, output, errors)


def _become_iibr(
    arguments: list[str], cwd: Path, environment: dict[str, str], folder: Path, max_bytes: int | None
) -> None:
    for descriptor, name in ((1, folder / "output"), (2, folder / "errors")):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT), descriptor)
    os.dup2(os.open(folder / "input", os.O_RDONLY), 0)
    sys.stdin = os.fdopen(0, closefd=False)
    sys.stdout, sys.stderr = (os.fdopen(descriptor, "w", encoding="utf-8", closefd=False) for descriptor in (1, 2))
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(cwd)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if max_bytes is not None:
        import resource

        sys.dont_write_bytecode = True  # modules that are cut off would be kept
        resource.setrlimit(resource.RLIMIT_FSIZE, (max_bytes, max_bytes))
    sys.argv = ["iibr", *arguments]
    from viewer.entry import command

    command()
