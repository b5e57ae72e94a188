"""README, docs and CONTRIBUTING: links lead somewhere, pages are short, the site builds without a warning."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest
import typer

from iibr_core.exports.kinds import EXPORTS
from viewer.cli.main import app

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
MOST_LINES = 150
PAGES = sorted(
    (*ROOT.glob("*.md"), *DOCS.rglob("*.md"), *(ROOT / "benchmarks").rglob("*.md"), *(ROOT / "assets").rglob("*.md"))
)
LINK = re.compile(r"\]\(([^()\s]+(?:\([^()\s]*\))?)\)")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def prose(page: Path) -> str:
    """A page without its blocks of code and its code in lines."""
    return re.sub(r"`[^`\n]*`", "", FENCE.sub("", page.read_text("utf-8")))


def anchors(page: Path) -> set[str]:
    """As GitHub and MyST make them of headings."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text("utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def broken_links(page: Path) -> Iterator[str]:
    for target in LINK.findall(prose(page)):
        if re.match(r"https?://\w+\.\w+", target):
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        if not there.is_relative_to(ROOT) or not there.exists():
            yield f"{target}: no such file"
        elif anchor and anchor not in anchors(there):
            yield f"{target}: no such heading"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    assert list(broken_links(page)) == []


def test_a_broken_link_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "ROOT", tmp_path.resolve())
    page = tmp_path.resolve() / "a.md"
    page.write_text(
        "# One thing\n[a](#one-thing) [b](#other) [c](gone.md) ![d](a.md) [e](../up.md)\n```\n[f](x)\n```\n"
    )
    assert list(broken_links(page)) == ["#other: no such heading", "gone.md: no such file", "../up.md: no such file"]


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *DOCS.rglob("*.md")], ids=name_of)
def test_a_page_can_be_read_at_one_go(page: Path) -> None:
    assert len(page.read_text("utf-8").splitlines()) <= MOST_LINES


def test_every_picture_is_shown() -> None:
    shown = {(page.parent / target).resolve() for page in PAGES for target in LINK.findall(prose(page))}
    pictures = {path for path in DOCS.rglob("*.*") if path.suffix in (".png", ".svg", ".jpg", ".gif", ".webp")}
    assert pictures <= shown


def test_the_readme_begins_with_a_moving_picture() -> None:
    """It is small enough to load at once, and nothing but prose stands before it."""
    before, _, after = (ROOT / "README.md").read_text("utf-8").partition("![")
    picture = ROOT / LINK.findall(f"![{after}")[0]
    assert picture.suffix in (".gif", ".apng")
    assert picture.stat().st_size < 2_000_000
    assert "|" not in before
    assert before.count("\n") < 20


def test_the_page_of_exports_names_every_kind() -> None:
    rows = re.findall(r"^\| (`.+?`) \|", (DOCS / "exports.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(kind for row in rows for kind in re.findall(r"`([\w-]+)`", row)) == sorted(EXPORTS)


def commands_of(page: Path) -> Iterator[list[str]]:
    """The words of each `iibr` command in a page's blocks of code."""
    for block in FENCE.findall(page.read_text("utf-8")):
        for line in re.findall(r"^(?:.*&& )?(iibr .+)$", block, re.MULTILINE):
            yield shlex.split(line, comments=True)


@pytest.mark.parametrize("page", [page for page in PAGES if list(commands_of(page))], ids=name_of)
def test_commands_of_a_page_know_their_options(page: Path) -> None:
    commands = cast(Any, typer.main.get_command(app)).commands
    for words in commands_of(page):
        command = commands.get(words[1] if len(words) > 1 else "view", commands["view"])
        known = {name for option in command.params for name in (*option.opts, *option.secondary_opts)}
        known |= {"--out"} if "--output" in known else set()  # its former name
        assert {word for word in words[2:] if re.match("--?[a-z]", word)} <= known, words


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """As `make site` does."""
    pytest.importorskip("sphinx", reason="pip install '.[docs]'")
    pytest.importorskip("myst_parser", reason="pip install '.[docs]'")
    words = [sys.executable, "-P", "-m", "sphinx", "-q", "-W", "--keep-going", "-n", "-b", "html"]
    run = subprocess.run([*words, "-d", tmp_path / "trees", DOCS, tmp_path / "site"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "site" / "index.html").exists()
