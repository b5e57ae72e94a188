"""docs/architecture.md names files and records that are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROWS = [
    line.split("|")[1:-1]
    for line in (ROOT / "docs" / "architecture.md").read_text("utf-8").splitlines()
    if line.startswith("|") and "`" in line
]


def files_of(cell: str) -> list[Path]:
    """Names without a folder lie in that of the name before."""
    found: list[Path] = []
    for name in re.findall(r"`([\w/.]+)`", cell):
        place = ROOT / name if name.startswith(("viewer/", "shaders/", "web/")) else ROOT / "iibr_core" / name
        found.append(found[-1].parent / name if "/" not in name and found else place)
    return found


@pytest.mark.parametrize(("files", "records"), [row[-2:] for row in ROWS], ids=[row[0].strip() for row in ROWS])
def test_files_and_records_are_there(files: str, records: str) -> None:
    assert files_of(files)
    sources = [path.read_text("utf-8") for path in files_of(files)]
    core = "".join(path.read_text("utf-8") for room in ("iibr_core", "viewer") for path in (ROOT / room).rglob("*.py"))
    assert all(sources)
    for record in re.findall(r"`(\w+)`", records):
        assert re.search(rf"^class {record}\b", core, re.MULTILINE), record
