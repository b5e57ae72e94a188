"""`iibr evaluate` as a command: reports written, help, one line for bad input, nothing left behind."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.iibr_core.known_scenes import HEIGHT, WIDTH, write_grid, write_hci
from tests.viewer.cli.test_cli import run

REPORT = ["index.html", "report.json", "report.md"]


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder of two scenes."""
    write_grid(tmp_path / "data" / "square")
    write_hci(tmp_path / "data" / "row", 1, 3)
    return tmp_path / "data"


def test_all_scenes_of_a_folder_are_compared(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    out = tmp_path / "report"
    assert run(monkeypatch, "evaluate", data, "-o", out, "--views", 2, "--refine", "off") == 0
    *lines, last = capsys.readouterr().out.splitlines()
    assert last == str(out / "index.html")
    assert [line.split(":")[0] for line in lines if ":" in line] == ["row", "square", "square"]
    assert len([line for line in lines if re.match(r" +[\d.]+ dB  iibr, true map$", line)]) == 3
    assert sorted(path.name for path in out.iterdir()) == REPORT
    assert f"iibr evaluate {data}" in (out / "report.md").read_text()


def test_stages_are_left_out(monkeypatch: pytest.MonkeyPatch, data: Path, tmp_path: Path) -> None:
    words = ("evaluate", data / "square", "--views", 1, "--refine", "off", "-o")
    without = ("--without", "outpainting", "--without", "synthesise-patches", "--without", "split-mixed-pixels")
    for number, more in enumerate(((), without)):
        assert run(monkeypatch, *words, tmp_path / str(number), *more) == 0
    tables = [(tmp_path / str(number) / "report.md").read_text() for number in (0, 1)]
    rows = [re.findall(r"(?m)^\| iibr, true map \| ([\d.]+ \| [\d.]+ \| [\d.]+)", table) for table in tables]
    assert rows[0] != rows[1]
    assert "--without outpainting" in tables[1]


def test_a_report_is_replaced_only_by_force(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    (out := tmp_path / "report").mkdir()
    (out / "notes.txt").write_text("mine")
    words = ("evaluate", data / "row", "-o", out, "--views", 1, "--refine", "off")
    assert run(monkeypatch, *words) == 2
    assert "already exists; give --force" in capsys.readouterr().err
    assert run(monkeypatch, *words, "--force") == 0
    assert sorted(path.name for path in out.iterdir()) == sorted([*REPORT, "notes.txt"])


def test_an_own_map_is_compared_at_two_scales(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    flat = tmp_path / "flat.npy"
    np.save(flat, np.zeros((HEIGHT, WIDTH), np.float32))
    assert run(monkeypatch, "evaluate", data / "row", "-o", tmp_path / "report", "--disparity", flat) == 0
    figures = {name: float(db) for db, name in re.findall(r"([\d.]+) dB  (.+)", capsys.readouterr().out)}
    # flat disparity shows the photo everywhere
    assert figures["iibr, given map"] == figures["plain warp, given map"] == figures["unchanged photo"]
    assert figures["plain warp, given map, fitted"] == figures["one plane"] > figures["unchanged photo"]


def test_an_estimate_is_compared_with_a_guess_and_the_true_map(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    words = ("evaluate", data / "row", "-o", tmp_path / "report", "--disparity", "estimate", "--views", 1)
    assert run(monkeypatch, *words) == 0
    out = capsys.readouterr().out
    for name in ("one plane", "iibr, guess", "iibr, guess, fitted", "iibr, true map"):
        assert re.search(rf"(?m) dB  {name}$", out)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("evaluate", "{dir}/gone", "--out", "{dir}/o"), "gone"),
        (("evaluate", "{dir}/empty", "--out", "{dir}/o"), "empty"),
        (("evaluate", "{data}", "--out", "{dir}/file"), "file"),
        (("evaluate", "{data}", "--out", "{dir}/o", "--disparity", "guess"), "--disparity guess"),
        (("evaluate", "{data}", "--out", "{dir}/o", "--disparity", "{dir}/file"), "file"),
        (("evaluate", "{data}", "--out", "{dir}/o", "--views", "0"), "--views"),
        (("evaluate", "{data}", "--out", "{dir}/o", "--without", "gaps"), "outpainting"),
        (("evaluate", "{data}", "--out", "{dir}/o", "--lpips", "{dir}/empty"), "alexnet"),
        (("evaluate", "{dir}/broken", "--out", "{dir}/o"), "v00_u01.png"),
        (("evaluate", "--out", "{dir}/o"), "DATASET"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    data: Path,
    tmp_path: Path,
    words: tuple[str, ...],
    named: str,
) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("no map")
    (write_grid(tmp_path / "broken") / "gt_disp_u01_v01.npy").unlink()
    (tmp_path / "broken" / "views" / "v00_u01.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    before = sorted(tmp_path.rglob("*"))
    assert run(monkeypatch, *(word.format(dir=tmp_path, data=data) for word in words)) == 2
    captured = capsys.readouterr()
    (line,) = captured.err.splitlines()
    assert line.startswith("iibr: ")
    assert named in line
    assert captured.out == ""
    assert sorted(tmp_path.rglob("*")) == before


def test_missing_packages_are_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path
) -> None:
    monkeypatch.setattr("iibr_core.runtime.extras.find_spec", lambda name: None)
    assert run(monkeypatch, "evaluate", data, "--out", data / "report") == 2
    assert "pip install 'iibr[evaluate]'" in capsys.readouterr().err
