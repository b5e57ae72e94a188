"""`iibr evaluate`: reports, refusals in one line, nothing left behind."""

import re
from pathlib import Path

import pytest

from tests.iibr_core.known_scenes import write_grid, write_hci
from tests.viewer.cli.conftest import output_of, refusal_of

REPORT = ["index.html", "report.json", "report.md"]


@pytest.fixture
def data(tmp_path, monkeypatch):
    """A folder of two scenes in the working folder."""
    monkeypatch.chdir(tmp_path)
    write_grid(tmp_path / "data" / "square")
    write_hci(tmp_path / "data" / "row", 1, 3)
    return tmp_path / "data"


def test_all_scenes_of_a_folder_are_compared(iibr, data):
    *lines, last = output_of(iibr("evaluate", "data", "-o", "report", "--views", 1, "--refine", "off")).splitlines()
    assert last == "report/index.html"
    assert [line.split(":")[0] for line in lines if ":" in line] == ["row", "square", "square"]
    assert len([line for line in lines if re.match(r" +[\d.]+ dB  iibr, true map$", line)]) == 3
    assert sorted(path.name for path in Path("report").iterdir()) == REPORT
    assert "iibr evaluate data" in Path("report/report.md").read_text()


def test_stages_are_left_out(iibr, data):
    words = ("evaluate", data / "row", "--views", 1, "--refine", "off", "-o")
    without = ("--without", "outpainting", "--without", "synthesise-patches", "--without", "split-mixed-pixels")
    output_of(iibr(*words, "0"))
    output_of(iibr(*words, "1", *without))
    tables = [Path(name, "report.md").read_text() for name in ("0", "1")]
    rows = [re.findall(r"(?m)^\| iibr, true map \| ([\d.]+ \| [\d.]+ \| [\d.]+)", table) for table in tables]
    assert rows[0] != rows[1]
    assert "--without outpainting" in tables[1]


def test_a_report_is_replaced_with_force_only(iibr, data):
    Path("report").mkdir()
    Path("report/notes.txt").write_text("mine")
    words = ("evaluate", data / "row", "-o", "report", "--views", 1, "--refine", "off")
    assert "already exists; give --force" in refusal_of(iibr(*words))
    output_of(iibr(*words, "--force"))
    assert sorted(path.name for path in Path("report").iterdir()) == sorted([*REPORT, "notes.txt"])
