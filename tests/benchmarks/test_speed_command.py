"""`python -m benchmarks.speed`: what it writes, and one line for bad input."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks.harness.reports import start
from benchmarks.speed.__main__ import main
from tests.iibr_core.known_scenes import write_grid


def run(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr(sys, "argv", ["speed", *map(str, words)])
    try:
        start("benchmarks.speed", main)
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def test_it_writes_tables_and_plots(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr("benchmarks.harness.bench_scenes.MOST_JUDGED", 3)
    write_grid(tmp_path / "square", 5)
    out = tmp_path / "docs"
    out.mkdir()
    assert run(monkeypatch, "--data", tmp_path / "square", "--out", out, "--quick", "--repeats", 1) == 0
    assert capsys.readouterr().out.splitlines() == [str(out / f"speed.{kind}") for kind in ("md", "svg")]
    text = (out / "speed.md").read_text()
    assert "| half width |" in text
    assert "## Mean over scenes, maps as they are" in text


@pytest.mark.parametrize(
    ("data", "out", "named"), [("known", "gone", "gone"), ("empty", "", "empty"), ("bare", "", "bare")]
)
def test_bad_input_is_one_line(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    data: str,
    out: str,
    named: str,
) -> None:
    (tmp_path / "empty").mkdir()
    write_grid(tmp_path / "known")
    (write_grid(tmp_path / "bare") / "gt_disp_u01_v01.npy").unlink()
    assert run(monkeypatch, "--data", tmp_path / data, "--out", tmp_path / out) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("benchmarks.speed: ")
    assert named in line
