"""Where the program begins and ends: `iibr`, and `python -m viewer`.

Interruption is heard before anything is imported that takes time. Standard streams that are closed, full or gone, and
what nobody expected, end in one line as all else does.
"""

from __future__ import annotations

import atexit
import gc
import io
import os
import sys

TYPE_CHECKING = False  # as typing's, which is not loaded yet
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

EXIT_UNEXPECTED, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 1, 2, 130
INTERRUPT_AGAIN_S = 0.02
MOST_TRIED_THREADS = 64
"""As many as OpenBLAS starts at most."""
NUMBA_THREADS = "NUMBA_NUM_THREADS"
MOST_NUMBA_THREADS = 1024
TOO_FEW_THREADS = "can't start new thread"
"""What Python says."""
LEAST_ADDRESS_SPACE = 256 * 2**20
"""With less, OpenBLAS ends the process by itself."""
TOO_LITTLE_MEMORY = ("failed to map segment", "Cannot allocate memory")
"""What libraries say that are loaded."""
COLLECT_AFTER = 100_000, 20, 100
"""Thresholds of Python's garbage collector. Its own, from 700 objects on, cost 0.3 s while modules are imported."""
TRACEBACK_VARIABLE = "IIBR_TRACEBACK"
"""With this in the environment, errors that are told here come with their traceback."""


def command() -> None:
    """The `iibr` command: `main`, then the end of the process. Only functions registered at exit run before: freeing
    half a million objects takes 0.2 s.
    """
    try:
        main()
    except SystemExit as ending:
        atexit._run_exitfuncs()
        os._exit(ending.code if isinstance(ending.code, int) else EXIT_UNEXPECTED)


def main() -> None:
    """Run the command line; raises SystemExit. 2 and one line on stderr for bad input and for files and output that
    fail, 130 and one line for Ctrl-C, SIGTERM and SIGHUP, 1 and one line for what nobody expected.
    """
    try:
        code = _run()
    except KeyboardInterrupt:
        code = _tell("interrupted", EXIT_INTERRUPTED)
    # Python kills itself at the end where an interruption has passed through exec (dataclasses are made so), unless
    # another one has come to its end since.
    exec("")
    # From here on there is nothing left to interrupt, and libraries that are taken down half answer with tracebacks.
    _on_interruption(lambda *_: os._exit(code))
    sys.exit(code)


def _run() -> int:
    """The exit code. Raises KeyboardInterrupt."""
    _on_interruption(_end_at_once)
    gc.set_threshold(*COLLECT_AFTER)
    if os.name == "posix":
        _mend_standard_streams()
    else:
        _escape_unknown_characters()
    _ensure_home()
    _ignore_warnings()
    if not 1 <= _whole_number(os.environ.get(NUMBA_THREADS) or "1") <= MOST_NUMBA_THREADS:
        said = f"{NUMBA_THREADS}={os.environ[NUMBA_THREADS]}: is not a number of threads"
        return _tell(f"{said}; give 1 to {MOST_NUMBA_THREADS}, or leave it out", EXIT_BAD_INPUT)
    try:
        os.getcwd()
    except OSError as error:
        return _tell(f"the working folder is gone ({error.strerror}); go to another one", EXIT_BAD_INPUT)
    try:
        _require_threads()
        _require_address_space()
        return _run_command()
    except Exception as error:
        return _tell_error(error)


def _run_command() -> int:
    from signal import default_int_handler

    from viewer.cli.main import main as run_command

    # A command has things to put away: it ends by KeyboardInterrupt.
    sys.unraisablehook = _interrupt_again
    _on_interruption(default_int_handler)
    try:
        run_command()
    except SystemExit as ending:
        code = ending.code if isinstance(ending.code, int) else EXIT_UNEXPECTED
    try:
        sys.stdout.flush()
    except OutputLostError as error:
        return code or _tell_error(error)
    return code


def _on_interruption(handler: Callable[[int, Any], Any]) -> None:
    """Have Ctrl-C, SIGTERM and SIGHUP handled so; those that are ignored (nohup, background jobs) stay so."""
    import signal

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows knows no SIGHUP
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def _end_at_once(*_: Any) -> None:
    """While modules are imported: some take an exception that strikes them there for something else."""
    _tell("interrupted", EXIT_INTERRUPTED)
    os._exit(EXIT_INTERRUPTED)


def _interrupt_again(lost: Any) -> None:
    """An interruption that struck where no exception can be raised (a callback from C) comes back a little later."""
    if not isinstance(lost.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(lost)
        return
    from signal import SIGINT, raise_signal
    from threading import Timer

    # The system's own signal: it ends whatever the main thread waits for by then. On Windows it would end the process.
    is_posix = os.name == "posix"
    send = (os.kill, (os.getpid(), SIGINT)) if is_posix else (raise_signal, (SIGINT,))
    is_started = False
    while not is_started:
        again = Timer(INTERRUPT_AGAIN_S, *send)
        again.daemon = True
        try:
            again.start()
            is_started = True
        except KeyboardInterrupt:  # on a busy machine it strikes before the timer is known to run, and would be lost
            pass


def _tell(message: str, code: int) -> int:
    print(f"iibr: {' '.join(message.split())}", file=sys.stderr)
    return code


def _tell_error(error: Exception) -> int:
    """What no command has caught: the system's refusals, and mistakes of ours."""
    if os.environ.get(TRACEBACK_VARIABLE):
        import traceback

        traceback.print_exception(error)
    said = str(error).strip().partition("\n")[0][:200]
    if isinstance(error, OutputLostError):
        # Or the interpreter tries once more to get rid of what is left, and complains.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return _tell(f"standard output: {said}; what was printed is lost", EXIT_BAD_INPUT)
    if isinstance(error, OSError):
        file = os.fsdecode(error.filename) if isinstance(error.filename, str | bytes) else "a file"
        return _tell(f"{file}: {error.strerror or said} ({TRACEBACK_VARIABLE}=1 shows where)", EXIT_BAD_INPUT)
    if isinstance(error, MemoryError) or any(words in str(error) for words in TOO_LITTLE_MEMORY):
        return _tell("out of memory before anything was read; raise the limit (ulimit -v, or -d)", EXIT_BAD_INPUT)
    if TOO_FEW_THREADS in said:
        return _tell("no more threads may be started here; raise the limit of processes (ulimit -u)", EXIT_BAD_INPUT)
    kind = type(error).__name__
    return _tell(f"unexpected {kind}: {said} (please report it; {TRACEBACK_VARIABLE}=1 shows more)", EXIT_UNEXPECTED)


class OutputLostError(Exception):
    """Standard output takes nothing more. No OSError, because Typer ends in silence at some of those."""


class _Output(io.FileIO):
    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise OutputLostError(error.strerror) from error


class _Diagnostics(io.FileIO):
    def write(self, data: Any) -> int:
        """Nobody reads notes that cannot be written, and no work is worth less for it."""
        try:
            return super().write(data)
        except OSError:
            return len(data)


def _mend_standard_streams() -> None:
    """Let closed ones be empty or refuse, so that no file of ours takes their numbers. Names that the encoding of the
    terminal has no characters for are printed with escapes.
    """
    for number, flags in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, flags)  # the lowest number that is free: this one
    sys.stdin = sys.stdin or open(0, closefd=False)  # noqa: SIM115
    sys.stdout = _text_stream(_Output(1, "w", closefd=False), sys.stdout)
    sys.stderr = _text_stream(_Diagnostics(2, "w", closefd=False), sys.stderr)


def _escape_unknown_characters() -> None:
    """The same for the streams as Python opened them; a program without a console has none."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _text_stream(raw: io.FileIO, like: Any) -> io.TextIOWrapper:
    encoding = like.encoding if like else "utf-8"
    by_lines = like is None or like.line_buffering or like.write_through
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding, "backslashreplace", line_buffering=by_lines)


def _require_threads() -> None:
    """Raise RuntimeError where a thread for each core cannot be started: libraries interrupt or abort the process, and
    print several lines.
    """
    from _thread import allocate_lock, start_new_thread

    ends = allocate_lock()

    def wait() -> None:
        with ends:
            pass

    with ends:
        for _ in range(min(os.cpu_count() or 1, MOST_TRIED_THREADS)):
            start_new_thread(wait, ())


def _require_address_space() -> None:
    """Raise MemoryError where not even the libraries can be loaded."""
    try:
        import resource
    except ImportError:  # Windows knows no such limits
        return
    limits = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA))
    if any(0 <= limit < LEAST_ADDRESS_SPACE for limit in limits):
        raise MemoryError


def _whole_number(text: str) -> int:
    """0 where it is none."""
    return int(text) if text.strip().isdecimal() and len(text) < 10 else 0


def _ignore_warnings() -> None:
    """What libraries warn of says nothing to people; Python's own option -W brings it back."""
    if not sys.warnoptions:
        import warnings

        warnings.simplefilter("ignore")


def _ensure_home() -> None:
    """Nothing is kept in the working folder: where HOME makes no sense the user database counts, and nowhere is home
    to users that it does not know.
    """
    if "HOME" in os.environ and not os.path.isabs(os.environ["HOME"]):
        del os.environ["HOME"]
    if not os.path.isabs(os.path.expanduser("~")):
        os.environ["HOME"] = os.devnull
