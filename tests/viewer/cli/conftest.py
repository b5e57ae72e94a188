"""The command line, run in the process of the tests."""

import subprocess
import sys

import pytest

from viewer import entry

Done = subprocess.CompletedProcess[str]


@pytest.fixture
def iibr(monkeypatch, capsys):
    """Run `iibr` with these arguments; its exit code, stdout and stderr are as those of a process."""

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["iibr", *map(str, words)])
        capsys.readouterr()
        code = entry.run()
        return Done(words, code, *capsys.readouterr())

    return run


def output_of(done):
    """Return what a command that must succeed wrote to stdout."""
    assert done.returncode == 0, done.stderr
    return done.stdout


def refusal_of(done, code=2):
    """Return the only line of a command that must fail."""
    assert (done.returncode, done.stdout) == (code, ""), done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line and not line.startswith("libpng ")]
    assert line.startswith("iibr: ")
    return line


def contents(folder):
    """Return everything in a folder, hidden files too, by path; None for folders."""
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}
