"""Pages of Markdown as programs find their way in them: parts between marks, tables below headings."""

from __future__ import annotations

import re
from pathlib import Path

from iibr_core.types import InputError


def put_between(page: str, mark: str, text: str) -> str:
    """The page with a text between its `<!-- MARK -->` and `<!-- /MARK -->`. Raises InputError where it has not one."""
    begin, end = f"<!-- {mark} -->", f"<!-- /{mark} -->"
    if page.count(begin) != 1 or page.count(end) != 1:
        raise InputError(f"a page holds {begin} and {end} not just once")
    before, rest = page.split(begin)
    return f"{before}{begin}\n{text.strip()}\n{end}{rest.split(end)[1]}"


def table(page: Path, heading: str, column: str = "") -> list[list[str]]:
    """Rows of cells, the head first, of the first table below a heading that begins so, which has the column.

    A mark counts as a heading. Raises InputError where there is none.
    """
    text = page.read_text("utf-8")
    below = re.split(rf"^(?:#+ |<!-- ){re.escape(heading)}.*$", text, maxsplit=1, flags=re.MULTILINE)[1:]
    section = re.split(r"^(?:#+ |<!-- )", below[0], maxsplit=1, flags=re.MULTILINE)[0] if below else ""
    for block in re.findall(r"(?:^\|.*\n?)+", section, flags=re.MULTILINE):
        rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in block.splitlines()]
        if any(name.startswith(column) for name in rows[0]):
            return [rows[0], *rows[2:]]
    raise InputError(f"{page.name}: has no table {column!r} below {heading!r}")


def cell(page: Path, heading: str, row: str, column: str) -> str:
    """Return the cell of the row and the column that begin so; "a | b": a row whose first cells are a and b. Raises
    InputError if there is none.
    """
    names, *rows = table(page, heading, column)
    place = next(k for k, name in enumerate(names) if name.startswith(column))
    for cells in rows:
        if " | ".join(cells).startswith(row):
            return cells[place]
    raise InputError(f"{page.name}: has no row {row!r} below {heading!r}")
