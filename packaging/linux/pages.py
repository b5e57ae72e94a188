"""Write what lies beside a packed program: its manual page, changelog, copyright and AppStream record.

python -P packaging/linux/pages.py FOLDER
"""

from __future__ import annotations

import gzip
import os
import re
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from email.utils import format_datetime
from pathlib import Path
from subprocess import check_output
from textwrap import indent
from typing import Any

import typer

from viewer.cli.main import app
from viewer.version import program_version

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
METAINFO = "io.github.iibr.iibr.metainfo.xml"
COMMIT_TIME = ("git", "log", "-1", "--format=%ct")
MAINTAINER = "The iibr project <iibr@users.noreply.github.com>"


def main(folder: Path) -> None:
    """Write all pages into a folder."""
    version, time = program_version(), datetime.fromtimestamp(int(source_date()), UTC)
    record = (HERE / METAINFO).read_text("utf-8").replace("@VERSION@", version).replace("@DATE@", f"{time:%Y-%m-%d}")
    pages = {"iibr.1": manual_page(version, time), "changelog": debian_changelog(version, time)}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / METAINFO).write_text(record, "utf-8")
    for name, text in pages.items():
        (folder / f"{name}.gz").write_bytes(gzip.compress(text.encode(), mtime=0))


def source_date() -> str:
    """Return the time of the sources in seconds since 1970: SOURCE_DATE_EPOCH, or else that of the last commit."""
    return os.environ.get("SOURCE_DATE_EPOCH") or check_output(COMMIT_TIME, cwd=ROOT, text=True)


def debian_changelog(version: str, time: datetime) -> str:
    """Return the newest section of the changelog in Debian's form."""
    newest = (ROOT / "CHANGELOG.md").read_text("utf-8").split("\n## ")[1].partition("\n")[2]
    marked = re.sub(r"### (.*)", r"[ \1 ]", newest.replace("\n- ", "\n* "))
    lines = indent(marked.strip(), "  ")
    return f"iibr ({version}) stable; urgency=medium\n\n{lines}\n\n -- {MAINTAINER}  {format_datetime(time)}\n"


def manual_page(version: str, time: datetime) -> str:
    """Return the manual page of all commands, from their help."""
    program: Any = typer.main.get_command(app)
    head = f'.TH IIBR 1 {time:%Y-%m-%d} "iibr {version}" "User Commands"'
    parts = [head, ".SH NAME", "iibr \\- viewer that turns one photo into a light field", ".SH SYNOPSIS"]
    parts += [".B iibr", "[COMMAND] [PATH] [OPTIONS]", ".SH DESCRIPTION", _text(program.help), *_options(program)]
    parts += [".SH COMMANDS", *_commands("iibr", program.commands)]
    return "\n".join(parts) + "\n"


def _commands(parent: str, commands: dict[str, Any]) -> Iterator[str]:
    for name, command in commands.items():
        context = typer.Context(command)
        words = " ".join([parent, name, *(word for item in command.params for word in item.get_usage_pieces(context))])
        yield from (f".SS {_text(words)}", _text(command.help or ""), *_options(command))
        yield from _commands(f"{parent} {name}", getattr(command, "commands", {}))


def _options(command: Any) -> Iterator[str]:
    records = (option.get_help_record(typer.Context(command)) for option in command.params)
    for names, help_text in filter(None, records):
        yield from (".TP", f".B {_text(names)}", _text(help_text))


def _text(words: str) -> str:
    """Return words for a line of roff: no escapes, no requests, paragraphs kept."""
    plain = re.sub(r"\\(?=\[)|`", "", words).replace("\\", "\\e").replace("-", "\\-")
    paragraphs = (" ".join(part.split()) for part in plain.split("\n\n"))
    return "\n.PP\n".join("\\&" + part if part[:1] in (".", "'") else part for part in paragraphs)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
