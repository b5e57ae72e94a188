"""Print every text that a person reads, with its place: labels, tooltips, notices, helps and errors.

    python -m docs.words [TEXT ...]

Lists strings of several words, labels of the window, and the help of commands. TEXT: print only lines that contain
all of these.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = "iibr_core", "viewer"
LABELS = "viewer/ui/", "viewer/model/commands.py", "viewer/model/layout.py", "iibr_core/exports/kinds.py"
"""Sources whose single words are labels."""
PROGRAM_TEXT = re.compile(r"[\\<>#]|;\s*$|^%|^\W*$|^[a-z]+$|^[a-z_]*[_:/][a-z_]*$")
"""Regular expressions, XML, shaders, identifiers."""
COMMAND_HELP = "Example: iibr"


def main() -> None:
    """Print the texts, sorted by file."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            for line, text in sorted(texts_of(path)):
                entry = f"{path.relative_to(ROOT)}:{line}: {' '.join(text.split())}"
                if all(wanted in entry for wanted in sys.argv[1:]):
                    print(entry)


def texts_of(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of each string of a source that a person reads."""
    nodes = list(ast.walk(ast.parse(path.read_text("utf-8"))))
    parts = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    docstrings = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    has_labels = str(path.relative_to(ROOT)).startswith(LABELS)
    for node in nodes:
        if isinstance(node, ast.FunctionDef) and COMMAND_HELP in (ast.get_docstring(node) or ""):
            yield node.lineno, ast.get_docstring(node) or ""
        if isinstance(node, ast.expr) and id(node) not in parts | docstrings and is_text(text_of(node), has_labels):
            yield node.lineno, text_of(node)


def text_of(node: ast.expr) -> str:
    """Return a string with its expressions in braces; "" for anything else."""
    if isinstance(node, ast.JoinedStr):
        parts = (part.value if isinstance(part, ast.Constant) else ast.unparse(part) for part in node.values)
        return "".join(map(str, parts))
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def is_text(text: str, has_labels: bool) -> bool:
    """Return whether a person reads a string."""
    if PROGRAM_TEXT.search(text.strip()):
        return False
    return bool(re.search(r"[A-Za-z]{2,}[^ ]* +[^ ]", text)) or (has_labels and text[:1].isupper())


if __name__ == "__main__":
    main()
