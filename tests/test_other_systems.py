"""Nothing that Windows lacks is used without a way around: read from the sources, for want of a Windows."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "termios", "tty"}
MEMBERS = re.compile(
    r"os\.(fork\w*|get(e?[ug]id|pgid|loadavg)|set(sid|pgid|[ug]id)|killpg|nice|mkfifo|f?statvfs|l?chown|fch(mod|own|dir)"
    r"|sched_\w+|uname|pipe2|pread|pwrite|sendfile|wait(pid)?|register_at_fork|O_(CLOEXEC|DIRECTORY|NOFOLLOW|NONBLOCK|SYNC))"
    r"|signal\.(SIG(?!INT|TERM|_IGN|_DFL)\w+|alarm|setitimer|pause|pthread_\w+|sigwait\w*)|socket\.AF_UNIX|time\.tzset"
)
GUARD = re.compile(r"os\.name|sys\.platform|hasattr\((os|signal)|fcntl is (not )?None")
USERS = {
    "iibr_core/formats/unfinished.py": {"fcntl", "os.O_NOFOLLOW", "os.O_NONBLOCK"},
    "iibr_core/runtime/machine.py": {"os.sched_getaffinity", "resource"},
    "iibr_core/exports/batch/ledger.py": {"fcntl"},
    "iibr_core/exports/batch/processes.py": {"resource", "signal.SIG_BLOCK", "signal.pthread_sigmask"},
    "viewer/app/window_slot.py": {"fcntl"},
    "viewer/entry.py": {"resource"},
}
"""All files that may, and what."""


def unguarded_and_used(source: str) -> tuple[set[str], set[str]]:
    """(what is used of MODULES and MEMBERS with no guard before it in the same function, all that is used)."""
    unguarded, used = set(), set()
    for scope in scopes_of(ast.parse(source)):
        guards = [node.lineno for node in scope if is_guard(node)]
        for node in scope:
            for name in names_of(node):
                used.add(name)
                if not any(line <= node.lineno for line in guards):
                    unguarded.add(name)
    return unguarded, used


def scopes_of(tree: ast.Module) -> Iterator[list[ast.AST]]:
    """The nodes of each function, and of what lies outside of all."""
    inner: set[ast.AST] = set()
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)):
        nodes = list(ast.walk(function))
        inner |= set(nodes)
        yield nodes
    yield [node for node in ast.walk(tree) if node not in inner]


def is_guard(node: ast.AST) -> bool:
    if isinstance(node, ast.If | ast.IfExp):
        return GUARD.search(ast.unparse(node.test)) is not None
    return isinstance(node, ast.Try) and any("ImportError" in ast.unparse(caught) for caught in node.handlers)


def names_of(node: ast.AST) -> set[str]:
    if isinstance(node, ast.Import):
        return {alias.name for alias in node.names} & MODULES
    if isinstance(node, ast.ImportFrom):
        members = {
            f"{node.module}.{alias.name}" for alias in node.names if MEMBERS.fullmatch(f"{node.module}.{alias.name}")
        }
        return members | ({str(node.module)} & MODULES)
    if isinstance(node, ast.Attribute):
        return {name for name in (ast.unparse(node),) if MEMBERS.fullmatch(name)}
    if isinstance(node, ast.Call) and ast.unparse(node.func).endswith(("get_context", "set_start_method")):
        return {"fork"} if "fork" in "".join(map(ast.unparse, node.args)) else set()
    return set()


def test_what_windows_lacks_is_used_behind_a_guard() -> None:
    files = {path: path.read_text("utf-8") for room in ("iibr_core", "viewer") for path in (ROOT / room).rglob("*.py")}
    found = {path.relative_to(ROOT).as_posix(): unguarded_and_used(text) for path, text in files.items()}
    assert {name: unguarded for name, (unguarded, _) in found.items() if unguarded} == {}
    assert {name: used for name, (_, used) in found.items() if used} == USERS


@pytest.mark.parametrize(
    "source",
    [
        "import fcntl",
        "def run():\n    import resource",
        "from os import fork",
        "def run():\n    os.kill(1, signal.SIGKILL)",
        "def run():\n    multiprocessing.get_context('fork')",
        "def run():\n    os.geteuid()\n    if os.name == 'posix':\n        pass",
        "if os.name == 'posix':\n    pass\ndef run():\n    os.setsid()",
    ],
)
def test_what_has_no_guard_is_found(source: str) -> None:
    assert unguarded_and_used(source)[0]


@pytest.mark.parametrize(
    "source",
    [
        "try:\n    import fcntl\nexcept ImportError:\n    fcntl = None",
        "def run():\n    if sys.platform == 'win32':\n        return\n    import resource",
        "def run():\n    return len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else 1",
        "def run():\n    signal.signal(signal.SIGINT, signal.SIG_IGN)",
    ],
)
def test_what_has_one_is_not(source: str) -> None:
    assert not unguarded_and_used(source)[0]
