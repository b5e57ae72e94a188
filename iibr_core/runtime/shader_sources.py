"""Sources of shaders from files, with their includes and defines.

Drivers disagree about `#line`, so the flattened source keeps a table of its own: line n of it came from (file, line).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

_INCLUDE = re.compile(r'\s*#include\s+"([^"]+)"')


class ShaderError(RuntimeError):
    """A shader that does not compile or link; the message starts with its file and line."""


@dataclass(frozen=True)
class FlatSource:
    """One shader stage as the driver gets it. origins[n] is the (file name, line) that line n (from 0) came from."""

    text: str
    origins: tuple[tuple[str, int], ...]

    def locate(self, line: int) -> str:
        """Return the origin of a line (from 1) of the flattened text, as "file:line"."""
        name, original = self.origins[min(max(line, 1), len(self.origins)) - 1]
        return f"{name}:{original}"


def flatten(path: Path, defines: Mapping[str, int] | None = None) -> FlatSource:
    """Return a shader with its includes (each once, from `include/` beside it) and `#define`s after line 1.

    Raises ShaderError for an include that does not exist.
    """
    lines = list(_included_lines(path, seen=set()))
    # The first line, #version, must stay first.
    lines[1:1] = [
        (f"#define {name} {value}", "defines", i) for i, (name, value) in enumerate((defines or {}).items(), 1)
    ]
    return FlatSource("\n".join(text for text, _, _ in lines) + "\n", tuple((name, n) for _, name, n in lines))


def _included_lines(path: Path, seen: set[Path]) -> Iterator[tuple[str, str, int]]:
    folder = path.parent if path.parent.name == "include" else path.parent / "include"
    for number, text in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        include = _INCLUDE.match(text)
        if include is None:
            yield text, path.name, number
            continue
        target = folder / include[1]
        if not target.is_file():
            raise ShaderError(f"{path.name}:{number}: no such include: {include[1]}")
        if target not in seen:
            seen.add(target)
            yield from _included_lines(target, seen)
