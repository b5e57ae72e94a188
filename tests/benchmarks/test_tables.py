import shlex
from pathlib import Path

import numpy as np
import pytest

from benchmarks import __main__ as dispatch
from benchmarks.compare import command_line
from benchmarks.fuzz import fault_of, fuzz, samples
from benchmarks.report import ROOT, git
from benchmarks.scenes import MAPS
from benchmarks.tables import NEEDS, TABLES, Table, old_tables, put_between, write_table
from benchmarks.ways import chosen_ways
from iibr_core.types import InputError

PAGE = (
    "# A page\n\nPeople wrote this.\n\n<!-- times -->\nMade by `x` at commit 0123456.\n<!-- /times -->\n\nAnd this.\n"
)


def test_a_table_is_put_between_its_marks(tmp_path) -> None:
    (tmp_path / "page.md").write_text(PAGE)
    assert write_table(Table("times", "page.md", "tables --list --only window", 1), {}, tmp_path)
    text = (tmp_path / "page.md").read_text()
    commit = git("rev-parse", "--short", "HEAD")
    assert f"<!-- times -->\nMade by `python -m benchmarks tables --list --only window` at commit {commit}" in text
    assert "| window | docs/accuracy.md | `window` | X | 1 |\n<!-- /times -->\n\nAnd this.\n" in text
    assert text.startswith("# A page\n\nPeople wrote this.\n")


def test_a_program_that_fails_leaves_the_page(tmp_path, capsys) -> None:
    (tmp_path / "page.md").write_text(PAGE)
    assert not write_table(Table("times", "page.md", "nothing", 1), {}, tmp_path)
    assert not write_table(Table("absent", "page.md", "tables --list", 1), {}, tmp_path)
    assert "<!-- absent -->" in capsys.readouterr().out
    assert write_table(Table("times", "page.md", "guess --data DATA", 1), {}, tmp_path)
    assert NEEDS["DATA"] in capsys.readouterr().out
    assert (tmp_path / "page.md").read_text() == PAGE
    (tmp_path / "page.md").write_text(PAGE + PAGE)
    assert not write_table(Table("times", "page.md", "tables --list", 1), {}, tmp_path), "its marks stand twice"


def test_old_tables_are_listed(tmp_path) -> None:
    table, page = Table("times", "page.md", "guess", 1), tmp_path / "page.md"
    for commit, words in (("nothing", ["names no commit"]), ("0123456", ["an unknown number"]), ("HEAD", [])):
        text = "" if commit == "nothing" else f"Made by `x` at commit {commit}."
        page.write_text(put_between(PAGE, "times", text))
        found = list(old_tables([table], tmp_path))
        assert len(found) == len(words)
        assert all(word in line for word, line in zip(words, found))


def test_the_list_names_programs_that_are_there() -> None:
    assert len({table.name for table in TABLES}) == len(TABLES)
    for table in TABLES:
        assert set(table.needs) <= NEEDS.keys()
        if table.page:
            assert f"<!-- {table.name} -->" in (ROOT / table.page).read_text("utf-8")
        program = table.command.split()[0].replace("-", "_")
        assert program.startswith("docs/") or program in dispatch.programs()
        if program == "compare":
            options = command_line().parse_args(shlex.split(table.command)[1:])
            assert chosen_ways(options.ways)
            assert {*options.maps.split(",")} <= {*MAPS, "network"}
    assert sum(table.minutes for table in TABLES) <= 40
    page = (ROOT / "benchmarks" / "README.md").read_text("utf-8")
    assert all(f"| `{name.replace('_', '-')}" in page for name in dispatch.programs())


def test_every_valid_file_is_read_and_some_copies_are_refused(tmp_path) -> None:
    readers = samples(tmp_path / "now")
    assert len(readers) > 25
    for path, read in readers.items():
        assert fault_of(read, path) == "", path.name
    assert list(fuzz(readers, 2, 0, tmp_path)) == []


@pytest.mark.parametrize(
    ("message", "result", "fault"),
    [("one line", None, ""), ("two\nlines", None, "several"), ("", [np.array([np.nan])], "not finite")],
)
def test_faults_are_told_from_refusals(message, result, fault) -> None:
    def read(path: Path) -> list[np.ndarray] | None:
        if message:
            raise InputError(message)
        return result

    assert fault in fault_of(read, Path("a"))
    assert bool(fault) == bool(fault_of(read, Path("a")))
