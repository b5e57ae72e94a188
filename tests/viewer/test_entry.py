"""The first and last moments of the program."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.viewer.cli.conftest import Iibr, iibr, refusal_of

__all__ = ["iibr"]
ROOT = Path(__file__).parents[2]


def in_shell(line: str) -> subprocess.CompletedProcess[str]:
    """Run a line in bash, in which "iibr" runs the program. Exit code: of the first program of a pipe."""
    script = f'iibr() {{ "{sys.executable}" -P -m viewer "$@"; }}; {line}; exit ${{PIPESTATUS[0]}}'
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(["bash", "-c", script], env=env, capture_output=True, text=True, timeout=120)


def test_output_that_cannot_be_written_is_one_line_and_a_reader_that_ends_is_no_error() -> None:
    assert "No space left" in refusal_of(in_shell("iibr --version > /dev/full"))
    assert in_shell("iibr models | head -0").stderr == ""


@pytest.mark.parametrize(
    ("failure", "code", "message"),
    [
        (OSError(5, "Input/output error", "a.png"), 2, "a.png: Input/output error"),
        (TypeError("x"), 1, "unexpected TypeError: x"),
        (EOFError("y"), 1, "unexpected EOFError: y"),
        (MemoryError("z"), 2, "out of memory (z)"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
    ids=repr,
)
def test_errors_are_one_line_and_unexpected_ones_are_logged(
    iibr: Iibr, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, failure: BaseException, code: int, message: str
) -> None:
    def load_photo(*_: object) -> None:
        raise failure

    monkeypatch.setattr("iibr_core.scenes.photo.load_photo", load_photo)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert message in refusal_of(iibr("plan", "photo.png"), code)
    if code == 1:
        (log,) = tmp_path.rglob("traceback.log")
        assert "in load_photo" in log.read_text()
        monkeypatch.setenv("IIBR_TRACEBACK", "1")
        assert "in load_photo" in iibr("plan", "photo.png").stderr
