"""The command line, run in the process of the tests."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from viewer import entry

Done = subprocess.CompletedProcess[str]
Iibr = Callable[..., Done]


@pytest.fixture
def iibr(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iibr:
    """Run `iibr` with these arguments; its exit code, stdout and stderr are as those of a process."""

    def run(*words: object) -> Done:
        monkeypatch.setattr(sys, "argv", ["iibr", *map(str, words)])
        capsys.readouterr()
        code = entry.run()
        return Done(words, code, *capsys.readouterr())

    return run


def output_of(done: Done) -> str:
    """Return what a command that must succeed wrote to stdout."""
    assert done.returncode == 0, done.stderr
    return done.stdout


def refusal_of(done: Done, code: int = 2) -> str:
    """Return the only line of a command that must fail."""
    assert (done.returncode, done.stdout) == (code, ""), done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line and not line.startswith("libpng ")]
    assert line.startswith("iibr: ")
    return line


def contents(folder: Path) -> dict[str, bytes | None]:
    """Return everything in a folder, hidden files too, by path; None for folders."""
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}
