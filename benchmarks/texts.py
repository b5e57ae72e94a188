"""Every text that the window can show, with its place: python -m benchmarks.texts [FOLDER ...]

Labels, tooltips, notices and what is wrong, read from the source: every string of it that reads as words, but for
docstrings. Without folders those of the window; `iibr_core` has the errors and notes that come up in it.
"""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
WINDOW = ("viewer/ui", "viewer/model", "viewer/app", "viewer/background")
"""Folders whose texts people see beside the picture."""

NAMES = {"TypeVar", "Literal", "NewType", "getattr", "resolve_name", "import_module"}
"""Calls and types whose strings are for the code."""

WORDS = re.compile(r"[A-Za-z]{2,}\W+[A-Za-z]|^[A-Z][a-z]+…?$")
FILLED = "{}"


@dataclass(frozen=True)
class Text:
    """A string as people see it; what is filled in is {}. file: relative to the source's folder."""

    file: str
    line: int
    words: str


def texts_in(folders: tuple[str, ...] = WINDOW) -> list[Text]:
    """Return the texts of all files in these folders, in order."""
    files = (path for folder in folders for path in sorted((ROOT / folder).rglob("*.py")))
    return [text for path in files for text in texts_of(path.read_text("utf-8"), str(path.relative_to(ROOT)))]


def texts_of(source: str, name: str) -> Iterator[Text]:
    """Yield the texts of one file's source, in order."""
    tree = ast.parse(source)
    skipped = {id(part) for part in ast.walk(tree) if _is_for_code(part) for part in ast.walk(part)}
    for node in ast.walk(tree):
        words = None if id(node) in skipped else _words_of(node)
        if words is not None and WORDS.search(words):
            skipped |= {id(part) for part in ast.walk(node)}
            yield Text(name, getattr(node, "lineno", 0), " ".join(words.split()))


def _is_for_code(node: ast.AST) -> bool:
    """Docstrings and strings that stand alone, types, and names that are resolved."""
    match node:
        case ast.Expr(value=ast.Constant()):
            return True
        case ast.Subscript(value=ast.Name(id=name)) | ast.Call(func=ast.Name(id=name)):
            return name in NAMES
        case ast.AnnAssign(annotation=annotation) if isinstance(annotation, ast.Constant):
            return True
    return False


def _words_of(node: ast.AST) -> str | None:
    match node:
        case ast.Constant(value=str(words)):
            return words.partition("##")[0]
        case ast.JoinedStr(values=parts):
            return "".join(str(part.value) if isinstance(part, ast.Constant) else FILLED for part in parts)
    return None


def main() -> None:
    """Print them: place, tab, words."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", default=WINDOW, help="folders of the source, relative to it")
    for text in texts_in(tuple(parser.parse_args().folders)):
        print(f"{text.file}:{text.line}\t{text.words}")


if __name__ == "__main__":
    main()
