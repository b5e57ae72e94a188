"""Run the program: `iibr`, and `python -m viewer`. One handler turns every error into one line."""

from __future__ import annotations

import gc
import os
import signal
import sys
import traceback
import warnings
from contextlib import suppress
from pathlib import Path

EXIT_UNEXPECTED, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 1, 2, 130
STDOUT, STDERR = 1, 2
"""File descriptors of the output and of the messages."""
GC_THRESHOLDS = 100_000, 20, 100
"""Thresholds of Python's garbage collector. Its usual ones, from 700 objects on, cost 0.3 s during imports."""
TRACEBACK_VARIABLE = "IIBR_TRACEBACK"
"""Environment variable that asks for the traceback of an unexpected error on stderr."""


def command() -> None:
    """Run the command line and end the process."""
    code = run()
    gc.freeze()  # Python ends without examining half a million objects
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:  # already reported; Python would try once more and change the exit code
        _discard(STDOUT)
    if sys.stderr is not None:  # OpenImageIO's binding lists the objects that are alive at the end of Python
        sys.stderr.flush()
        _discard(STDERR)
    sys.exit(code)


def open_window() -> None:
    """Run `iibr open`, for starts without a console."""
    sys.argv.insert(1, "open")
    command()


def _discard(descriptor: int) -> None:
    """Write what comes to this file descriptor nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


def run() -> int:
    """Run the command line. Return the exit code: 2 for bad input, 130 for Ctrl-C and SIGTERM, 1 for unexpected errors.

    Each error is one line on stderr.
    """
    if getattr(sys, "frozen", False):
        _enter_bundle()
    gc.set_threshold(*GC_THRESHOLDS)
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # libraries' warnings; Python's option -W shows them
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a program without a console has no stream
            stream.reconfigure(errors="backslashreplace")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        from viewer.cli.main import app

        code = int(app(standalone_mode=False) or 0)
        if sys.stdout is not None:
            sys.stdout.flush()
    except KeyboardInterrupt:
        code = EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader ended, as in `iibr models | head -1`
        return EXIT_UNEXPECTED
    except Exception as error:
        return _report(error)
    if code == EXIT_INTERRUPTED:
        print("iibr: interrupted", file=sys.stderr)
    return code


def _enter_bundle() -> None:
    """Give child programs the system's libraries instead of the bundle's. A worker process works, and ends here."""
    import multiprocessing

    os.environ.pop("LD_LIBRARY_PATH", None)
    if "LD_LIBRARY_PATH_ORIG" in os.environ:  # what PyInstaller replaced
        os.environ["LD_LIBRARY_PATH"] = os.environ.pop("LD_LIBRARY_PATH_ORIG")
    multiprocessing.freeze_support()


def _report(error: Exception) -> int:
    """Print an error as one line, and show it to a person who sees no terminal. Return the exit code."""
    import typer

    from iibr_core.types import InputError
    from viewer.cli.messages import words_of

    if isinstance(error, typer.Abort) and isinstance(error.__cause__, EOFError):
        error = error.__cause__  # Typer takes the end of any file for an interruption
    if isinstance(error, typer.Abort):  # Ctrl-C or the end of input at a question
        message, code = "interrupted", EXIT_INTERRUPTED
    elif isinstance(error, InputError):
        message, code = words_of(error), EXIT_BAD_INPUT
    elif hasattr(error, "format_message"):  # Typer's errors about the words of a command
        message, code = f"{error.format_message()} (see --help)", EXIT_BAD_INPUT
    elif isinstance(error, MemoryError):
        message, code = f"out of memory ({error}): lower --max-pixels or --grid", EXIT_BAD_INPUT
    elif isinstance(error, OSError):
        message, code = f"{error.filename or 'a file'}: {error.strerror or error}", EXIT_BAD_INPUT
    else:
        log = _log_traceback(error)
        message, code = f"unexpected {type(error).__name__}: {str(error)[:200]} (report it with {log})", EXIT_UNEXPECTED
    message = " ".join(message.split())
    print(f"iibr: {message}", file=sys.stderr)
    if _is_started_from_desktop():
        with suppress(Exception):  # the error itself may lie in a library that the dialog needs
            from viewer.app.dialogs import show_error

            show_error(message)
    return code


def _is_started_from_desktop() -> bool:
    """Return whether a menu or file manager opened a window, without a terminal that shows stderr."""
    word = "".join(sys.argv[1:2])
    if sys.stderr is None:
        return not word or word in ("open", "view", "demo") or os.path.exists(word)
    return word == "open" and not any(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stderr))


def log_file() -> Path:
    """Return the file for the traceback of the last unexpected error; its folder may not exist yet."""
    from platformdirs import user_log_path

    return user_log_path("iibr", appauthor=False) / "traceback.log"


def _log_traceback(error: Exception) -> str:
    """Write the traceback to a log, and to stderr if that is asked for. Return the name of the log."""
    text = "".join(traceback.format_exception(error))
    if os.environ.get(TRACEBACK_VARIABLE):
        print(text, file=sys.stderr)
    path = log_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    except OSError:
        return f"{TRACEBACK_VARIABLE}=1"
    return str(path)
