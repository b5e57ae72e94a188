"""docs/architecture.md names files and records that are there."""

from __future__ import annotations

import ast
import re
from importlib import import_module
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


@pytest.mark.parametrize(("files", "records"), [row[1:] for row in ROWS], ids=[row[0].strip() for row in ROWS])
def test_files_and_records_are_there(files: str, records: str) -> None:
    assert files_of(files)
    sources = [path.read_text("utf-8") for path in files_of(files)]
    core = "".join(path.read_text("utf-8") for room in ("iibr_core", "viewer") for path in (ROOT / room).rglob("*.py"))
    assert all(sources)
    for record in re.findall(r"`(\w+)`", records):
        assert re.search(rf"^class {record}\b", core, re.MULTILINE), record


MOST_CORE_MODULES = 20
"""That the viewer and the command line import. A room offers names in its `__init__.py`: take them from there."""


def taken_of_the_core() -> dict[str, set[str]]:
    """Names that the viewer and the command line take, by module."""
    taken: dict[str, set[str]] = {}
    for path in (ROOT / "viewer").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "iibr_core":
                taken.setdefault(node.module, set()).update(name.name for name in node.names)
    return taken


def test_the_viewer_reaches_the_core_by_its_rooms() -> None:
    taken = taken_of_the_core()
    assert len(taken) <= MOST_CORE_MODULES, sorted(taken)


@pytest.mark.parametrize(
    "init", [path for path in (ROOT / "iibr_core").rglob("__init__.py")], ids=lambda p: p.parent.name
)
def test_a_room_has_every_name_that_it_offers_and_none_in_vain(init: Path) -> None:
    blocks = [node for node in ast.parse(init.read_text("utf-8")).body if isinstance(node, ast.If)]
    room = import_module(".".join(init.parent.relative_to(ROOT).parts))
    offered = {name.name for block in blocks for node in block.body for name in getattr(node, "names", ())}
    assert all(hasattr(room, name) for name in offered)
    assert init == ROOT / "iibr_core" / "__init__.py" or offered <= taken_of_the_core().get(room.__name__, set())
    assert not any((init.parent / f"{name}.py").exists() for name in offered), "a file hides a name"
