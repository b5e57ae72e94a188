"""Reports of tables: their place, and what they begin with."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from benchmarks.harness.report import DOCS, title
from benchmarks.harness.report import markdown as markdown

FOLDER = DOCS / "tables"


def write_report(name: str, words: str, parts: Iterable[str], path: Path | None = None) -> None:
    """docs/tables/NAME.md, or path."""
    text = "\n".join([title(words, f"benchmarks.tables.{name}"), *(f"{part}\n" for part in parts)])
    (path or FOLDER / f"{name}.md").write_text(text, "utf-8")
