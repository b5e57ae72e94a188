"""Sources of shaders from files, for whatever compiles them: includes, defines.

Drivers disagree about `#line`, so the flattened source keeps a table of its own: line n of it came from (file, line).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
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
    """Source of a shader with its includes (each once, from `include/` beside it) and `#define`s after line 1.

    Raises ShaderError for an include that does not exist.
    """
    lines = _included_lines(path, seen=set())
    injected = [
        (f"#define {name} {value}", "defines", i + 1) for i, (name, value) in enumerate((defines or {}).items())
    ]
    lines[1:1] = injected  # #version must stay first
    return FlatSource("\n".join(text for text, _, _ in lines) + "\n", tuple((name, n) for _, name, n in lines))


def _included_lines(path: Path, seen: set[Path]) -> list[tuple[str, str, int]]:
    lines: list[tuple[str, str, int]] = []
    for number, text in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        include = _INCLUDE.match(text)
        if include is None:
            lines.append((text, path.name, number))
            continue
        base = path.parent if path.parent.name == "include" else path.parent / "include"
        target = base / include[1]
        if not target.is_file():
            raise ShaderError(f"{path.name}:{number}: no such include: {include[1]}")
        if target not in seen:
            seen.add(target)
            lines += _included_lines(target, seen)
    return lines
