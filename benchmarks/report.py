"""Markdown tables, and the commit that a table was made at."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]


def markdown(names: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table."""
    lines = [names, ["---"] * len(names), *rows]
    return "\n".join(f"| {' | '.join(map(str, cells))} |" for cells in lines)


def is_wanted(name: str, words: str) -> bool:
    """Return whether a name contains one of these words, separated by commas; no words mean every name."""
    return any(word in name for word in words.split(","))


def git(*words: str) -> str:
    """Return the output of git in this checkout, "" if it fails."""
    run = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    return "" if run.returncode else run.stdout.strip()
