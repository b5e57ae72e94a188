"""Rooms that offer names of their files: a file is imported once one of its names is asked for."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

_IMPORT = re.compile(r"^    from (\S+) import (?:\(([^)]*)\)|([^(\n]+))$", re.MULTILINE)


def offered_by(init: str) -> Callable[[str], Any]:
    """The `__getattr__` of a package: it has the names that its file, `init`, imports where types are checked."""

    def find(name: str) -> Any:
        if name not in _places_in(init):
            raise AttributeError(f"package {Path(init).parent.name!r} has no attribute {name!r}")
        return getattr(import_module(_places_in(init)[name]), name)

    return find


@cache
def _places_in(init: str) -> dict[str, str]:
    found = _IMPORT.findall(Path(init).read_text("utf-8"))
    return {name: module for module, many, one in found for name in re.findall(r"\w+", many or one)}
