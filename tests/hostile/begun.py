"""Run under a case's limits, environment and streams: a Python that has imported `iibr` and forks for each command.

    python -P begun.py ASKED TOLD SHELL_HAS_OUTPUT MODULE ...

ASKED, TOLD: descriptors: of lines of JSON (folders of work and of what is told, arguments; environment; all bytes in
hex, as the locale may know no such characters), and of exit codes in answer.
The fork is as if Python had just started there: it runs `main` and ends as Python ends. Of its own package nothing is
imported here, for what is tried out may go wrong in any of it.
"""

from __future__ import annotations

import json
import os
import sys


def main() -> None:
    asked, told = int(sys.argv[1]), int(sys.argv[2])
    shell_has_output, modules = sys.argv[3] == "True", sys.argv[4:]
    _import_as_the_program_does(modules, shell_has_output)
    with os.fdopen(asked, closefd=False) as lines:
        for line in lines:
            child = os.fork()
            if child == 0:
                os.close(asked)
                os.close(told)
                _become(*json.loads(line), shell_has_output)
                return
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            os.write(told, f"{code}\n".encode())


def _import_as_the_program_does(modules: list[str], shell_has_output: bool) -> None:
    """With a home that makes sense and no warnings, as `main` sees to before it imports them."""
    is_closed = shell_has_output and sys.stdout is None
    if is_closed:
        os.open(os.devnull, os.O_WRONLY)  # or the first file that a library opens takes its number
    environment = dict(os.environ)
    from viewer import entry

    entry._ensure_home()
    entry._ignore_warnings()
    for module in modules:
        __import__(module)
    os.environ.clear()
    os.environ.update(environment)
    if is_closed:
        os.close(1)


def _become(words: list[str], environment: dict[str, str], shell_has_output: bool) -> None:
    """Where the command runs, and what it is told; its output goes where the shell says, if it says so."""
    work, told, *arguments = map(_text, words)
    for number, name in ((1, "output"), (2, "errors")):
        if number == 2 or not shell_has_output:
            opened = os.open(os.path.join(told, name), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(opened, number)
            if opened != number:
                os.close(opened)
    os.environ.clear()
    os.environ.update({name: _text(value) for name, value in environment.items()})
    os.chdir(work)
    sys.argv = ["iibr", *arguments]


def _text(in_hex: str) -> str:
    return os.fsdecode(bytes.fromhex(in_hex))


if __name__ == "__main__":
    main()
    if sys.argv[0] == "iibr":
        from viewer.entry import main as run_iibr

        run_iibr()
