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


def test_evaluate_judges_all_scenes_of_a_folder(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    out = tmp_path / "report"
    assert run(monkeypatch, "evaluate", data, "--out", out, "--views", 2, "--refine", "off") == 0
    *lines, last = capsys.readouterr().out.splitlines()
    assert last == str(out / "index.html")
    assert [line.split(":")[0] for line in lines] == ["row", "square", "square"]
    assert all(re.search(r"identity [\d.]+, reference warp [\d.]+, iibr [\d.]+ dB$", line) for line in lines)
    assert sorted(path.name for path in out.iterdir()) == REPORT
    assert f"iibr evaluate {data}" in (out / "report.md").read_text()


def test_stages_are_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    words = ("evaluate", data / "square", "--views", 1, "--refine", "off", "--out")
    without = ("--without", "outpainting", "--without", "synthesise-patches", "--without", "split-mixed-pixels")
    told = []
    for number, more in enumerate(((), without)):
        assert run(monkeypatch, *words, tmp_path / str(number), *more) == 0
        told.append(re.search(r"iibr ([\d.]+) dB", capsys.readouterr().out))
    assert all(told)
    assert (tmp_path / "0" / "report.json").read_text() != (tmp_path / "1" / "report.json").read_text()
    assert "--without outpainting" in (tmp_path / "1" / "report.md").read_text()


def test_a_report_that_is_there_is_replaced_only_by_force(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    (out := tmp_path / "report").mkdir()
    (out / "notes.txt").write_text("mine")
    words = ("evaluate", data / "row", "--out", out, "--views", 1, "--refine", "off")
    assert run(monkeypatch, *words) == 2
    assert "already exists; give --force" in capsys.readouterr().err
    assert run(monkeypatch, *words, "--force") == 0
    assert sorted(path.name for path in out.iterdir()) == sorted([*REPORT, "notes.txt"])


def test_a_disparity_of_ones_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], data: Path, tmp_path: Path
) -> None:
    flat = tmp_path / "flat.npy"
    np.save(flat, np.zeros((HEIGHT, WIDTH), np.float32))
    words = ("--views", 1, "--disparity", flat)
    assert run(monkeypatch, "evaluate", data / "square", "--out", tmp_path / "report", *words) == 0
    line = capsys.readouterr().out.splitlines()[0]
    values = dict(re.findall(r"(identity|reference warp|iibr) ([\d.]+)", line.partition("flat.npy")[2]))
    assert values.keys() == {"identity", "reference warp", "iibr"}
    # flat disparity shows the photo everywhere
    assert len(set(values.values())) == 1


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
