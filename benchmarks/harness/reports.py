"""The command line and the reports of benchmarks: shared options, tables, the command that made a report."""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from iibr_core.formats.outputs import write_file
from iibr_core.runtime.machine import core_count
from iibr_core.types import InputError

CORES = core_count()

WITH_CHANGES = " (with changes)"
"""After a commit's name: the files were not what that commit has."""
DOCS = Path(__file__).parents[2] / "docs"
NO_PAGES = (
    ":/",
    ":(top,exclude)*.md",
    ":(top,exclude)docs/*.png",
    ":(top,exclude)docs/*.svg",
    ":(top,exclude)docs/*.jpg",
    ":(top,exclude)docs/*.gif",
)
COMMON: dict[str, dict[str, Any]] = {
    "data": {"type": Path, "metavar": "DIR", "help": "a scene as `iibr evaluate` takes it, or a folder of them"},
    "out": {"type": Path, "help": "file for the report, which is printed, too"},
    "seed": {"type": int, "default": 0},
    "repeats": {"type": int, "default": 3, "help": "rounds, of which medians are taken"},
    "only": {"default": "", "help": "those whose name contains one of these words, by commas"},
}
"""Options that mean the same wherever they are."""


def parser_of(doc: str | None, *common: str, **changes: dict[str, Any]) -> argparse.ArgumentParser:
    """A program's command line, described by its module's text. common: names of COMMON; changes: to those."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in (*common, *(name for name in changes if name not in common)):
        parser.add_argument(f"--{name}", **{**COMMON[name], **changes.get(name, {})})
    return parser


def start(module: str, main: Callable[[], None]) -> None:
    """Run a program; bad input ends it in one line and exit code 2."""
    try:
        main()
    except InputError as error:
        print(f"{module}: {error}", file=sys.stderr)
        sys.exit(2)


def is_wanted(name: str, only: str) -> bool:
    """Return whether --only names it."""
    return any(word in name for word in only.split(","))


def emit(lines: Iterable[str], out: Path | None = None) -> None:
    """Print lines as they come, and write all of them at the end."""
    printed = []
    for line in lines:
        printed.append(line)
        print(line, flush=True)
    if out is not None:
        with write_file(out) as unfinished:
            unfinished.write_text("\n".join(printed).rstrip("\n") + "\n", "utf-8")


def title(words: str, module: str, more: str = "") -> str:
    """Return the beginning of a report: heading, command, commit, machine."""
    return f"# {words}\n\n{made_by(['python', '-m', module, *sys.argv[1:]])}.{more and ' ' + more}\n"


def made_by(command: Sequence[str]) -> str:
    """A command, the commit where it is known, the machine; no full stop. Folders of scenes are called DATA."""
    words = [
        Path(command[0]).name,
        *("DATA" if before == "--data" else word for before, word in pairwise(command)),
    ]
    commit = current_commit()
    return f"Made by `{shlex.join(words)}`{commit and ' at commit ' + commit}, on {CORES} cores"


@cache
def current_commit() -> str:
    """Return the short name of the commit checked out, "" outside a checkout. WITH_CHANGES follows it if files differ,
    pages and pictures apart: those are being made.
    """
    name = git("rev-parse", "--short", "HEAD")
    changes = git("status", "--porcelain", "--untracked-files=no", "--", *NO_PAGES)
    return name and name + (WITH_CHANGES if changes else "")


def git(*words: str) -> str:
    """Return the output of git, "" if it fails."""
    try:
        run = subprocess.run(["git", *words], cwd=DOCS, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return run.stdout.strip()


def row(*cells: object) -> str:
    """A line of a table."""
    return f"| {' | '.join(map(str, cells))} |"


def head(*names: str) -> str:
    """Return the first two lines of a table."""
    return f"{row(*names)}\n{row(*['---'] * len(names))}"


def markdown(names: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A whole table."""
    return "\n".join([head(*names), *(row(*cells) for cells in rows)])


def holds(is_so: bool | None) -> str:
    """Return in a word whether a figure meets its target; None if this system cannot measure it."""
    return {True: "yes", False: "**no**", None: "not known here"}[is_so]
