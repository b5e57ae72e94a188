"""The first and last moments of the program."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.viewer.cli.conftest import iibr, refusal_of

__all__ = ["iibr"]
ROOT = Path(__file__).parents[2]


def in_shell(line):
    """Run a line in bash, in which "iibr" runs the program. Exit code: of the first program of a pipe."""
    script = f'iibr() {{ "{sys.executable}" -P -m viewer "$@"; }}; {line}; exit ${{PIPESTATUS[0]}}'
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(["bash", "-c", script], env=env, capture_output=True, text=True, timeout=120)


def test_output_that_cannot_be_written_is_one_line_and_a_reader_that_ends_is_no_error():
    assert "No space left" in refusal_of(in_shell("iibr --version > /dev/full"))
    assert in_shell("iibr models | head -0").stderr == ""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems show their dialog without a program")
@pytest.mark.parametrize(
    ("words", "has_stderr", "is_shown"),
    [
        ("open gone.png", True, True),
        ("view gone.png", False, True),
        ("view gone.png", True, False),
        ("export gone.png", False, False),
    ],
)
def test_an_error_is_shown_in_a_dialog_to_whoever_sees_no_terminal(tmp_path, words, has_stderr, is_shown):
    shown, dialog = tmp_path / "shown", tmp_path / "zenity"
    dialog.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" >> {shown}\n')
    dialog.chmod(0o755)
    code = f"import sys; sys.argv = {['iibr', *words.split()]}; from viewer.entry import command; command()"
    command = ["bash", "-c", f'"$0" -P -c "$1" {"" if has_stderr else ">&- 2>&-"}', sys.executable, code]
    env = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(command, env=env, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert ("gone.png: no such file" in done.stderr) is has_stderr
    assert shown.exists() is is_shown
    assert not is_shown or "gone.png: no such file" in shown.read_text()


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
def test_errors_are_one_line_and_unexpected_ones_are_logged(iibr, monkeypatch, tmp_path, failure, code, message):
    def load_photo(*_):
        raise failure

    monkeypatch.setattr("iibr_core.scenes.photo.load_photo", load_photo)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert message in refusal_of(iibr("plan", "photo.png"), code)
    if code == 1:
        (log,) = tmp_path.rglob("traceback.log")
        assert "in load_photo" in log.read_text()
        monkeypatch.setenv("IIBR_TRACEBACK", "1")
        assert "in load_photo" in iibr("plan", "photo.png").stderr
