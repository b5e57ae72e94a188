"""Make the tables and pictures of README and docs/ again, each by one command: `make figures DATA=DIR MODEL=FILE`.

    python -m benchmarks tables [--only NAME,...] [--data DATA] [--model FILE] [--list] [--check]

TABLES lists them. What a program prints replaces the text between `<!-- NAME -->` and `<!-- /NAME -->` of the page,
below a line with command and commit; the rest of the page stays. --check lists tables that are older than the code.
"""

from __future__ import annotations

import argparse
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.report import ROOT, git, markdown
from iibr_core.types import InputError

CODE = ("iibr_core", "viewer", "shaders", "web")
"""Folders whose changes make a table old."""
NEEDS = {
    "DATA": "scenes as `iibr evaluate` takes them: DATA=DIR",
    "MODEL": "a depth network as an ONNX file: MODEL=FILE",
    "X": "Xvfb and xdotool",
}


@dataclass(frozen=True)
class Table:
    """A table or a set of pictures.

    page: file that holds the marks, "" for a program that writes files itself. command: words of a program, DATA and
    MODEL for the folder of scenes and the network. minutes: on two slow cores.
    """

    name: str
    page: str
    command: str
    minutes: float

    @property
    def needs(self) -> list[str]:
        """Keys of NEEDS that the command needs."""
        return [need for need in NEEDS if need in self.command.split() or (need, self.name) == ("X", "window")]

    @property
    def words(self) -> str:
        """The command as a person would type it."""
        return f"python {'' if self.command.startswith('docs/') else '-m benchmarks '}{self.command}"


ACCURACY = "docs/accuracy.md"
EVERY_MAP = "exact,soft,resampled,phone"
ALONE = "--ways iibr,unchanged --maps exact,network,guess,plane --by scene --depth-model MODEL"
TABLES = (
    Table("photo-alone", ACCURACY, f"compare {ALONE} --data DATA", 3),
    Table("maps", ACCURACY, f"compare --ways 'iibr,iibr map,plain warp' --maps {EVERY_MAP} --drawn 4 --data DATA", 3),
    Table("stages", ACCURACY, f"compare --ways 'iibr,iibr without' --against iibr --maps {EVERY_MAP} --data DATA", 6),
    Table("disparity", ACCURACY, "disparity --data DATA", 3),
    Table("guess", ACCURACY, "guess --data DATA", 1),
    Table("window", ACCURACY, "window", 1),
    Table("pictures", "", "docs/make_pictures.py docs/gallery", 4),
)


def main() -> None:
    """Make tables, or list them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="names of tables, by commas")
    parser.add_argument("--data", type=Path, help=NEEDS["DATA"])
    parser.add_argument("--model", type=Path, help=NEEDS["MODEL"])
    parser.add_argument("--list", action="store_true", help="print the list and do nothing")
    parser.add_argument("--check", action="store_true", help="print the tables that are older than the code")
    options = parser.parse_args()
    wanted = [table for table in TABLES if not options.only or table.name in options.only.split(",")]
    if options.list:
        rows = ((t.name, t.page, f"`{t.command}`", ", ".join(t.needs), t.minutes) for t in wanted)
        print(markdown(("name", "page", "command", "needs", "minutes"), rows))
    elif options.check:
        print("\n".join(old_tables(wanted)) or "every table is as new as the code")
    else:
        given = {name: str(path.resolve()) for name, path in (("DATA", options.data), ("MODEL", options.model)) if path}
        sys.exit(any([not write_table(table, given) for table in wanted]))


def write_table(table: Table, given: Mapping[str, str], root: Path = ROOT) -> bool:
    """Run the program and put its output into the page; print how it went, and return whether it did.

    A table that this machine cannot make is named and stays. given: paths of DATA and MODEL.
    """
    has_x = all(map(shutil.which, ("Xvfb", "xdotool")))
    missing = [NEEDS[need] for need in table.needs if not (need in given or (need == "X" and has_x))]
    if missing:
        print(f"{table.name}: not made; needs {', '.join(missing)}")
        return True
    began, page = time.monotonic(), root / table.page
    try:
        if table.page:
            put_between(page.read_text("utf-8"), table.name, "")
        words = [given.get(word, word) for word in shlex.split(table.words)]
        run = subprocess.run([sys.executable, *words[1:]], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
        if run.returncode:
            raise InputError(f"the program ended with {run.returncode}")
        if table.page:
            is_changed = git("status", "--porcelain", "--untracked-files=no", "--", *CODE, "benchmarks")
            commit = git("rev-parse", "--short", "HEAD") + (", with changes" if is_changed else "")
            text = f"Made by `{table.words}` at commit {commit}.\n\n{run.stdout.strip()}"
            page.write_text(put_between(page.read_text("utf-8"), table.name, text), "utf-8")
    except InputError as error:
        print(f"{table.name}: failed: {error}", flush=True)
        return False
    print(f"{table.name}: made in {(time.monotonic() - began) / 60:.1f} minutes", flush=True)
    return True


def put_between(page: str, name: str, text: str) -> str:
    """Return the page with a text between the marks of a name. Raises InputError unless it has both marks once."""
    begin, end = f"<!-- {name} -->", f"<!-- /{name} -->"
    if page.count(begin) != 1 or page.count(end) != 1:
        raise InputError(f"the page does not hold {begin} and {end} once")
    before, rest = page.split(begin)
    return f"{before}{begin}\n{text}\n{end}{rest.split(end)[1]}"


def old_tables(tables: list[Table], root: Path = ROOT) -> Iterator[str]:
    """Yield a line for each table that names no commit, or one after which the code changed."""
    for table in (table for table in tables if table.page):
        marked = (root / table.page).read_text("utf-8").partition(f"<!-- {table.name} -->")[2]
        commit = re.search(r"at commit (\w+)", marked.partition(f"<!-- /{table.name} -->")[0])
        later = git("rev-list", "--count", f"{commit[1]}..HEAD", "--", *CODE) if commit else ""
        if later != "0":
            age = f"{later or 'an unknown number of'} commits behind" if commit else "names no commit"
            yield f"{table.page}, {table.name}: {age}"


if __name__ == "__main__":
    main()
