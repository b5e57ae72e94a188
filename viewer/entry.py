"""Where the program begins and ends: `iibr`, and `python -m viewer`. One handler turns every error into one line."""

from __future__ import annotations

import gc
import os
import signal
import sys
import warnings
from contextlib import suppress

EXIT_UNEXPECTED, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 1, 2, 130
COLLECT_AFTER = 100_000, 20, 100
"""Thresholds of Python's garbage collector. Its own, from 700 objects on, cost 0.3 s while modules are imported."""
TRACEBACK_VARIABLE = "IIBR_TRACEBACK"
"""With this in the environment, tracebacks of errors are printed too."""


def command() -> None:
    """Run the command line, and end the process at once: freeing half a million objects takes 0.2 s."""
    code = run()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # it is closed or full, which was reported
            stream.flush()
    os._exit(code)


def run() -> int:
    """Run the command line. Returns the exit code: 2 for bad input, 130 for Ctrl-C, SIGTERM and SIGHUP, 1 for errors
    that nobody expected; each with one line on stderr.
    """
    _set_up()
    try:
        from iibr_core.runtime.machine import limit_arenas
        from viewer.cli.main import app

        limit_arenas()
        code = app(standalone_mode=False)
        sys.stdout.flush()
        return int(code or 0)
    except KeyboardInterrupt:
        return _end("interrupted", EXIT_INTERRUPTED)
    except BrokenPipeError:  # as of `iibr models | head -1`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_UNEXPECTED
    except Exception as error:
        return _end_by(error)


def _end_by(error: Exception) -> int:
    import typer

    from iibr_core.types import InputError
    from viewer.cli.remedies import words_of

    if isinstance(error, InputError):
        return _end(words_of(error), EXIT_BAD_INPUT)
    if isinstance(error, typer.Abort):  # Click's word for Ctrl-C
        return _end("interrupted", EXIT_INTERRUPTED)
    if hasattr(error, "format_message"):  # Click's errors about the words of a command
        return _end(f"{error.format_message()} (--help tells more)", EXIT_BAD_INPUT)
    if isinstance(error, MemoryError):
        return _end(f"out of memory ({error}): lower --max-pixels, or the --grid", EXIT_BAD_INPUT)
    log = _keep_traceback(error)
    if isinstance(error, OSError):
        return _end(f"{error.filename or 'a file'}: {error.strerror or error}", EXIT_BAD_INPUT)
    kind = type(error).__name__
    return _end(f"unexpected {kind}: {str(error)[:200]} (please report it, with {log})", EXIT_UNEXPECTED)


def _end(message: str, code: int) -> int:
    """Print a message in one line on stderr. Returns the code."""
    print(f"iibr: {' '.join(message.split())}", file=sys.stderr)
    return code


def _set_up() -> None:
    gc.set_threshold(*COLLECT_AFTER)
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of libraries: Python's own option -W brings them back
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a program without a console has none
            stream.reconfigure(errors="backslashreplace")
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)


def _keep_traceback(error: Exception) -> str:
    """Write the traceback to the log, and print it where that is asked for. Returns the name of the log."""
    import traceback

    from platformdirs import user_log_path

    text = "".join(traceback.format_exception(error))
    if os.environ.get(TRACEBACK_VARIABLE):
        print(text, file=sys.stderr)
    path = user_log_path("iibr", appauthor=False) / "traceback.log"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    except OSError:
        return f"{TRACEBACK_VARIABLE}=1"
    return str(path)
