import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest
import typer

from iibr_core.exports.kinds import EXPORTS
from viewer.cli.main import app

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path for folder in ("", "docs", "benchmarks", "assets/weights") for path in (ROOT / folder).glob("*.md"))
LINK = re.compile(r"\]\(([^()\s]+(?:\([^()\s]*\))?)\)")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`([^`\n]*)`")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def prose(page: Path) -> str:
    return CODE.sub("", FENCE.sub("", page.read_text("utf-8")))


def anchors(page: Path) -> set[str]:
    """Return the anchors that GitHub and MyST make of a page's headings."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text("utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page) -> None:
    for target in LINK.findall(prose(page)):
        if not target.startswith("https://"):
            path, _, anchor = target.partition("#")
            there = (page.parent / path).resolve() if path else page
            assert there.is_relative_to(ROOT), target
            assert there.exists(), target
            assert not anchor or anchor in anchors(there), target


def test_every_picture_is_shown() -> None:
    shown = {(page.parent / target).resolve() for page in PAGES for target in LINK.findall(prose(page))}
    assert {path for path in DOCS.rglob("*.*") if path.suffix in (".png", ".svg", ".jpg", ".gif", ".webp")} <= shown


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/architecture.md"])
def test_files_and_names_that_developers_read_of_exist(page) -> None:
    """A file name without a folder lies in the folder of the file named before it, or in `iibr_core/`."""
    sources = "".join(
        path.read_text("utf-8") for room in ("iibr_core", "viewer") for path in ROOT.joinpath(room).rglob("*.py")
    )
    folder = ROOT
    for name in CODE.findall(FENCE.sub("", (ROOT / page).read_text("utf-8"))):
        if re.fullmatch(r"[\w-]+(/[\w.-]*)+|\w+\.\w+", name) and not name.startswith("out/"):
            places = [place / name for place in (ROOT, ROOT / "iibr_core", folder) if (place / name).exists()]
            assert places, name
            folder = places[-1].parent
        elif re.fullmatch(r"[A-Z]\w+", name):
            assert re.search(rf"^(class )?{name}\b", sources, re.MULTILINE), name


def test_the_page_of_exports_names_every_kind() -> None:
    rows = re.findall(r"^\| (`.+?`) \|", (DOCS / "exports.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(kind for row in rows for kind in re.findall(r"`([\w-]+)`", row)) == sorted(EXPORTS)


def commands_of(page: Path) -> Iterator[list[str]]:
    """Yield the words of each `iibr` command in a page's blocks of code."""
    for block in FENCE.findall(page.read_text("utf-8")):
        for line in re.findall(r"^(?:.*&& )?(iibr .+)$", block, re.MULTILINE):
            yield shlex.split(line, comments=True)


@pytest.mark.parametrize("page", [page for page in PAGES if list(commands_of(page))], ids=name_of)
def test_commands_of_a_page_know_their_options(page) -> None:
    commands = cast(Any, typer.main.get_command(app)).commands
    for words in commands_of(page):
        command = commands.get(words[1] if len(words) > 1 else "view", commands["view"])
        known = {name for option in command.params for name in (*option.opts, *option.secondary_opts)}
        assert {word for word in words[2:] if re.match("--?[a-z]", word)} <= known, words
