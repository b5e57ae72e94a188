"""What benchmarks share: their options, their tables, and how they end."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks.harness.reports import emit, is_wanted, parser_of, start, title
from iibr_core.types import InputError


def test_options_mean_the_same_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["program", "--seed", "3", "--data", "a"])
    found = parser_of("what it does", "seed", "repeats", "only", data={"required": True}).parse_args()
    assert (found.seed, found.repeats, found.only, found.data) == (3, 3, "", Path("a"))


def test_an_option_that_is_needed_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["program"])
    with pytest.raises(SystemExit):
        parser_of("what it does", data={"required": True}).parse_args()


@pytest.mark.parametrize(("only", "is_so"), [("", True), ("tea,shelf", True), ("tea", False)])
def test_scenes_are_chosen_by_words(only: str, is_so: bool) -> None:
    assert is_wanted("a shelf", only) == is_so


def test_lines_are_printed_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    emit(iter(["a", "b\n"]), tmp_path / "report.md")
    assert capsys.readouterr().out == "a\nb\n\n"
    assert (tmp_path / "report.md").read_text() == "a\nb\n"


def test_a_report_that_breaks_off_leaves_the_last_one(tmp_path: Path) -> None:
    def lines() -> object:
        yield "new"
        raise InputError("no scene")

    path = tmp_path / "report.md"
    path.write_text("old\n")
    with pytest.raises(InputError):
        emit(lines(), path)  # type: ignore[arg-type]
    assert path.read_text() == "old\n"


def test_bad_input_ends_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    def main() -> None:
        raise InputError("a: no such file")

    with pytest.raises(SystemExit) as ended:
        start("benchmarks.one", main)
    assert ended.value.code == 2
    assert capsys.readouterr().err == "benchmarks.one: a: no such file\n"


def test_a_report_says_what_made_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["x.py", "--data", "a b"])
    assert title("Words", "benchmarks.one").startswith("# Words\n\nMade by `python -m benchmarks.one --data DATA`")
