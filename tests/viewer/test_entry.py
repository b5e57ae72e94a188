"""The program's first and last moments, each in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
START = (sys.executable, "-P", "-m", "viewer")


def run(*words: object, start: tuple[str, ...] = START, **environment: str) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    return subprocess.run([*start, *map(str, words)], env=env, capture_output=True, text=True, timeout=120)


def error_of(done: subprocess.CompletedProcess[str], code: int = 2) -> str:
    """The only line on stderr."""
    assert done.returncode == code, done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("iibr: ")
    return line


def in_shell(line: str) -> subprocess.CompletedProcess[str]:
    """`line` in bash; in it, "iibr" runs the program. Exit code: of the first program of a pipe."""
    script = f'iibr() {{ "{sys.executable}" -P -m viewer "$@"; }}; {line}; exit ${{PIPESTATUS[0]}}'
    return run(start=("bash", "-c", script))


def test_a_program_started_by_nohup_ignores_the_end_of_its_terminal() -> None:
    done = in_shell("trap '' HUP; iibr --version & kill -HUP $!; wait $!")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("iibr ")


def test_a_full_disk_behind_standard_output_is_one_line() -> None:
    assert "No space left" in error_of(in_shell("iibr --version > /dev/full"))


def test_output_before_an_error_is_not_lost(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.jpg").write_text("no photo")
    done = run("batch", tmp_path / "in", "--to", "depth", "-o", tmp_path / "out")
    assert "0 written, 0 there before, 1 failed" in done.stdout
    assert "lists what failed" in error_of(done)


def test_a_reader_that_stops_reading_is_no_error_to_report() -> None:
    assert "Traceback" not in in_shell("iibr models | head -0").stderr


@pytest.mark.parametrize("failure", ["OSError(5, 'Input/output error', 'a.png')", "TypeError('x')", "MemoryError('y')"])
def test_unexpected_errors_are_one_line_with_a_traceback_in_the_log(tmp_path: Path, failure: str) -> None:
    code = f"""
import sys
import iibr_core.scenes.photo
def load_photo(*_): raise {failure}
iibr_core.scenes.photo.load_photo = load_photo
sys.argv = ["iibr", "plan", "photo.png"]
from viewer.entry import command
command()
"""
    start, state = (sys.executable, "-P", "-c", code), {"XDG_STATE_HOME": str(tmp_path)}
    line = error_of(run(start=start, **state), 1 if "Type" in failure else 2)
    words = {"OSError": "a.png: Input/output error", "TypeError": "TypeError: x", "MemoryError": "out of memory (y)"}
    assert words[failure.partition("(")[0]] in line
    if "Memory" not in failure:
        (log,) = tmp_path.rglob("traceback.log")
        assert "in load_photo" in log.read_text()
        assert "in load_photo" in run(start=start, IIBR_TRACEBACK="1", **state).stderr
