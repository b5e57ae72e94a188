"""Functions that Windows lacks are used behind a guard: read from the sources, because the tests run on Linux."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
UNIX_ONLY = re.compile(
    r"\b(import (fcntl|grp|pwd|pty|resource|termios|readline)\b|"
    r"os\.(fork|get[ep]?[ug]id|getpgid|getloadavg|set[su]id|killpg|mkfifo|statvfs|l?chown|fch\w+|sched_\w+|uname|O_NO\w+)\b|"
    r"signal\.(SIG(?!INT|TERM|_|BREAK)\w+|alarm|setitimer|pthread_\w+)|socket\.AF_UNIX|get_context\(['\"]fork)"
)
GUARD = re.compile(r"os\.name|sys\.platform|hasattr\((os|signal|socket)|except (ImportError|ModuleNotFoundError)")


def unguarded(source: str) -> list[str]:
    """Return the uses of UNIX_ONLY in a module, in functions and outside of them, with no guard before them."""
    if UNIX_ONLY.search(source) is None:
        return []
    tree, uses = ast.parse(source), []
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    outside = ast.Module([node for node in tree.body if not isinstance(node, ast.FunctionDef)], [])
    for scope in [*functions, outside]:
        words = ast.unparse(scope)
        guard = GUARD.search(words)
        uses += [use.group() for use in UNIX_ONLY.finditer(words) if guard is None]
    return uses


def test_unix_functions_are_used_behind_a_guard() -> None:
    files = [path for room in ("iibr_core", "viewer") for path in (ROOT / room).rglob("*.py")]
    assert {str(path): uses for path in files if (uses := unguarded(path.read_text("utf-8")))} == {}
