"""Comparing what a person is told (words, numbers, lists) with kept texts: words exactly, numbers by a tolerance.

One JSON file holds the texts of a table by the names of its rows. `pytest --regenerate-golden` writes them again.
"""

import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent / "golden"
NUMBER = re.compile(r"-?\d+\.\d+")


def assert_same_text(
    lines: Sequence[str], name: str, row: str, regenerate: bool, atol: float = 0.02, rtol: float = 0.01
) -> None:
    """Compare lines with those kept under `row` in NAME.json; numbers with a point may differ by the tolerance."""
    path = FOLDER / f"{name}.json"
    kept = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    if regenerate:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(kept | {row: list(lines)}, indent=1, ensure_ascii=False) + "\n", "utf-8")
        return
    expected = "\n".join(kept[row])
    found = "\n".join(lines)
    assert NUMBER.sub("#", found) == NUMBER.sub("#", expected), f"{found}\n--- expected:\n{expected}"
    numbers, wanted = ([float(number) for number in NUMBER.findall(text)] for text in (found, expected))
    assert numbers == pytest.approx(wanted, abs=atol, rel=rtol), f"{found}\n--- expected:\n{expected}"
