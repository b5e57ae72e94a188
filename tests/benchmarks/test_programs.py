"""Programs that are only run by hand: each can be imported, and says what it is for."""

from __future__ import annotations

import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import benchmarks

MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(benchmarks.__path__, "benchmarks.")
    if not module.name.endswith("__main__")
)


@pytest.mark.parametrize("name", MODULES)
def test_it_can_be_imported(name: str) -> None:
    assert importlib.import_module(name).__doc__


def test_the_list_of_programs_is_whole() -> None:
    folder = Path(benchmarks.__path__[0])
    sources = {path.relative_to(folder.parent): path.read_text("utf-8") for path in folder.rglob("*.py")}
    programs = {path for path, text in sources.items() if '__name__ == "__main__"' in text}
    named = re.findall(r"^\| `(benchmarks[\w.]*)", (folder / "README.md").read_text("utf-8"), re.MULTILINE)
    assert sorted(named) == sorted(".".join(path.with_suffix("").parts).removesuffix(".__main__") for path in programs)


@pytest.mark.parametrize("name", ["speed", "fuzz"])
def test_it_says_how_it_is_called(name: str) -> None:
    run = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{name}", "--help"], capture_output=True, text=True, check=True
    )
    assert "--" in run.stdout
