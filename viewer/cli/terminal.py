"""What commands say on stderr: a bar while they work; notes, and where depth comes from, once all went well: an error
is the only line.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from iibr_core.depth.choice import DepthOrigin
from iibr_core.runtime.compiling import watch_compiling
from iibr_core.runtime.time_left import TimeLeft, about_left
from iibr_core.types import ReportProgress

MAKING = "making views"
FORMER_NAMES = {"--out": "--output"}
"""Of options: they are understood still, and no help speaks of them."""
RARELY_USED = ("evaluate", "train")


class Commands(TyperGroup):
    """Typer ends without a word when it is interrupted, and takes the end of any file for an interruption; this one
    aborts for the one only, and whoever runs it says so. A path in place of a command is viewed.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order in which help lists them: what few people use comes last."""
        return sorted(super().list_commands(ctx), key=lambda name: name in RARELY_USED)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command's name, the command and its arguments. Raises UsageError where there is none of that name."""
        args = [
            FORMER_NAMES.get(name, name) + equals + value for name, equals, value in (a.partition("=") for a in args)
        ]
        is_viewed = args[0] not in self.commands and _is_path(args[0])
        return super().resolve_command(ctx, ["view", *args] if is_viewed else args)

    def make_context(self, *args: Any, **options: Any) -> Any:
        """Read the command line. Raises typer.Abort for KeyboardInterrupt."""
        with _interruption_aborts():
            return super().make_context(*args, **options)

    def invoke(self, ctx: Any) -> Any:
        """Run the command. Raises typer.Abort for KeyboardInterrupt, RuntimeError for EOFError."""
        with _interruption_aborts():
            return super().invoke(ctx)


def _as_named_now(word: str) -> str:
    name, equals, value = word.partition("=")
    return FORMER_NAMES.get(name, name) + equals + value


def _is_path(word: str) -> bool:
    """Whether it names a file or a folder, or would if there were one."""
    return os.path.exists(word) or bool(Path(word).suffix) or Path(word).name != word


@contextmanager
def _interruption_aborts() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt as error:
        raise typer.Abort from error
    except EOFError as error:
        raise RuntimeError(f"EOFError: {error}") from error


def print_notes(notes: tuple[str, ...]) -> None:
    """One line each, for the end of a command that succeeded: what it says on stdout comes first, and may fail."""
    sys.stdout.flush()
    for note in notes:
        print(f"note: {note}", file=sys.stderr)


def print_depth(origin: DepthOrigin | None) -> None:
    """One line about where depth comes from; none for light fields, and where the notes say it with advice."""
    if origin is not None and not origin.advice:
        print_notes((origin.line,))


@contextmanager
def show_progress(doing: str, counts: bool = False) -> Iterator[Callable[..., None]]:
    """A bar on stderr while the block runs; call what is yielded with (done, total, what is being done): work, see
    `TimeLeft`; a total of 0 is not known yet. counts: shows the numbers too.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        # A bar leaves empty lines there, and an error is to be the only line.
        yield lambda *_: None
        return
    time_left = TimeLeft()
    told = TextColumn("{task.fields[told]}")
    with Progress(
        "{task.description}", BarColumn(), TaskProgressColumn(), told, console=console, transient=True
    ) as bar:
        task = bar.add_task(doing, total=None, told="")

        def show(done: float, total: float, now: str = "") -> None:
            left_s = time_left.update(done, total)
            told = [f"{done:.0f} of {total:.0f}"] if counts and total else []
            told += [about_left(left_s)] if left_s else []
            said = now or (MAKING if total else doing)
            bar.update(
                task,
                completed=time_left.share,
                total=1.0 if total else None,
                description=said,
                told=", ".join(told),
            )

        with watch_compiling(lambda words: show(0, 0, words)):
            yield show


def untimed(show: Callable[..., None]) -> ReportProgress:
    """The share in words, without time: what follows takes longer or shorter."""
    return lambda done, total, doing: show(0, 0, f"{doing or MAKING}, {done / total:.0%}" if total else doing)
