"""What every report of a table begins with, and its place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.provenance import made_by

FOLDER = Path(__file__).parents[2] / "docs" / "tables"
MACHINE = "2 cores of an x86-64 server, no GPU"


def write_report(name: str, title: str, parts: Iterable[str], path: Path | None = None) -> None:
    """docs/tables/NAME.md, or path: title, command, commit and machine, then the parts."""
    head = f"# {title}\n\n{made_by(f'benchmarks.tables.{name}')}. {MACHINE}.\n"
    path = path or FOLDER / f"{name}.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([head, *(f"{part}\n" for part in parts)]), "utf-8")


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of words."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
