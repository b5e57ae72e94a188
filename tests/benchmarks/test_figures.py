"""`make figures`: what people wrote stays, tables are found again, every report says what made it."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import pytest

from benchmarks import figures
from benchmarks.figures import FIGURES, NEEDS, ROOT, Figure, make_all, stale_pages
from benchmarks.harness.pages import cell, put_between, table
from benchmarks.harness.readme import ACCURACY, TABLES, write_readme
from benchmarks.harness.reports import DOCS, WITH_CHANGES, current_commit, made_by
from iibr_core.types import InputError

PAGE = """# A page

What people wrote.

<!-- times -->
Made by `python -m old` at commit 0123456, on 2 cores.

| what | s |
| --- | --- |
| old | 9 |
<!-- /times -->

What they wrote below.

## Another

| scene | way | dB |
| --- | --- | --- |
| all | warp | 30.1 |
| all | ours | 32.5 |
"""
PICTURES = (".png", ".svg", ".jpg", ".gif", ".webp", ".apng")
REPORTS = sorted(str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md") if "Made by" in path.read_text("utf-8"))


def test_what_people_wrote_stays() -> None:
    made = put_between(PAGE, "times", "new\n")
    assert made.startswith("# A page\n\nWhat people wrote.\n\n<!-- times -->\nnew\n<!-- /times -->\n\nWhat they wrote")
    assert made.endswith(PAGE[PAGE.index("## Another") :])
    with pytest.raises(InputError, match="gone"):
        put_between(PAGE, "gone", "new")


def test_cells_are_found_again(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    assert table(page, "times", "s") == [["what", "s"], ["old", "9"]]
    assert cell(page, "Another", "all | ours", "dB") == "32.5"
    for heading, row, column in (("times", "new", "s"), ("times", "old", "dB"), ("gone", "old", "s")):
        with pytest.raises(InputError, match=r"page\.md"):
            cell(page, heading, row, column)


def test_a_command_names_no_folder_of_this_machine() -> None:
    said = made_by([sys.executable, "-m", "x", "--data", "/somewhere/else", "--only", "tea"])
    assert said.startswith(f"Made by `{Path(sys.executable).name} -m x --data DATA --only tea` at commit")


def test_a_page_is_made_between_its_marks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "DOCS", tmp_path)
    monkeypatch.setattr(figures, "write_readme", lambda root: ())
    (tmp_path / "program.py").write_text("print('| what | s |')\n")
    (tmp_path / "page.md").write_text(PAGE)
    assert not make_all([Figure(("page.md#times",), f"{tmp_path}/program.py", 1)], None)
    text = (tmp_path / "page.md").read_text()
    assert f"<!-- times -->\nMade by `python {tmp_path}/program.py` at commit {current_commit()}" in text
    assert "| what | s |\n<!-- /times -->" in text
    assert "old" not in text


def test_what_fails_leaves_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(figures, "DOCS", tmp_path)
    monkeypatch.setattr(figures, "write_readme", lambda root: ())
    (tmp_path / "program.py").write_text("raise SystemExit(3)\n")
    (tmp_path / "page.md").write_text(PAGE)
    assert make_all([Figure(("page.md#times",), f"{tmp_path}/program.py", 1)], None)
    assert "failed: ended with 3" in capsys.readouterr().out
    assert (tmp_path / "page.md").read_text() == PAGE


def test_what_a_machine_lacks_is_said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(figures, "write_readme", lambda root: ())
    assert not make_all([one for one in FIGURES if "DATA" in one.needs], None)
    for line in capsys.readouterr().out.splitlines():
        assert "left as it is; needs scenes" in line


def test_the_list_is_whole() -> None:
    """Every report and picture is made by a program, and every program is there."""
    places = [place for one in FIGURES for place in one.places]
    assert len(places) == len(set(places))
    assert set(REPORTS) <= {place.partition("#")[0] for place in places}
    pictures = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.*") if path.suffix in PICTURES}
    assert pictures == {place for place in places if not place.partition("#")[0].endswith(".md")}
    for one in FIGURES:
        assert set(one.needs) <= NEEDS.keys()
        assert ("DATA" in one.needs) == ("DATA" in one.command)
        if one.command.startswith("benchmarks"):
            path = ROOT / Path(*one.command.split()[0].split("."))
            assert path.with_suffix(".py").exists() or (path / "__main__.py").exists()
        for place in one.places:
            page, _, mark = place.partition("#")
            assert not mark or f"<!-- {mark} -->" in (DOCS / page).read_text("utf-8")


@pytest.mark.parametrize("name", REPORTS)
def test_every_report_says_what_made_it(name: str) -> None:
    """Its command and its commit; that is of a tree without changes. How far behind it is `--check` says."""
    text = (DOCS / name).read_text("utf-8")
    assert text.count("Made by `") == len(re.findall(r"Made by `[^`]+` at commit [0-9a-f]{7,}", text))
    assert WITH_CHANGES not in text
    assert "Since then" not in text


def test_the_readme_says_what_the_reports_say() -> None:
    assert all((ROOT / page).read_text("utf-8").count(f"<!-- {mark} -->") == 1 for mark, (page, _) in TABLES.items())
    assert list(write_readme(ROOT, only_check=True)) == []


@pytest.mark.parametrize(
    ("page", "mark", "row"), [("README.md", "views", "HCI "), (ACCURACY, "switches", "half width ")]
)
def test_a_changed_table_is_noticed(tmp_path: Path, page: str, mark: str, row: str) -> None:
    shutil.copytree(DOCS, tmp_path / "docs")
    shutil.copyfile(ROOT / "README.md", tmp_path / "README.md")
    text = (tmp_path / page).read_text("utf-8")
    (tmp_path / page).write_text(text.replace(f"| {row}", f"| un{row}"))
    assert list(write_readme(tmp_path, only_check=True)) == [f"{page}: table {mark} is not what its page says"]
    list(write_readme(tmp_path))
    assert (tmp_path / page).read_text("utf-8") == text


def test_an_old_report_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for page in figures.pages():
        (tmp_path / page).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / page).write_text("Made by `x`.\n")
    monkeypatch.setattr(figures, "DOCS", tmp_path)
    monkeypatch.setattr(figures, "write_readme", lambda root, only_check: ())
    assert next(stale_pages()) == "docs/evaluation/report.md: says no commit"
    newest = re.sub(r"\W.*", "", current_commit())
    if newest:
        for page in figures.pages():
            (tmp_path / page).write_text(f"Made by `x` at commit {newest}.\n")
        assert list(stale_pages()) == []
