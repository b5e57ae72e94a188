"""What commands say on stderr: a bar while they work; notes, and where depth comes from, once all went well: an error
is the only line.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from iibr_core.depth.choice import DepthOrigin
from iibr_core.runtime.compiling import watch_compiling
from iibr_core.runtime.time_left import TimeLeft, about_left
from iibr_core.runtime.work import watched
from viewer.cli.remedies import BETTER_DEPTH

FORMER_NAMES = {"--out": "--output"}
"""Former names of options, which are still understood."""
FORMER_OPTIONS = ("--quality", "--memory")
"""Options of earlier versions, each with a value, which are ignored."""
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
        args = _as_named_now(args)
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


def _as_named_now(words: list[str]) -> list[str]:
    """Return the words of a command line without former options and with the present names of the others."""
    found, rest = [], iter(words)
    for word in rest:
        name, equals, value = word.partition("=")
        if name not in FORMER_OPTIONS:
            found.append(FORMER_NAMES.get(name, name) + equals + value)
        elif not equals:
            next(rest, None)
    return found


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
    """Print where depth comes from, with advice if it is poor; nothing for light fields."""
    if origin is not None:
        print_notes((f"{origin.line} {BETTER_DEPTH}" if origin.is_poor else origin.line,))


@contextmanager
def show_progress(doing: str, counts: bool = False) -> Iterator[None]:
    """Show what the block reports, see `report_progress`, as a bar on stderr. counts: with numbers."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        # A bar leaves empty lines there, and an error is to be the only line.
        yield
        return
    time_left = TimeLeft()
    told = TextColumn("{task.fields[told]}")
    with Progress(
        "{task.description}", BarColumn(), TaskProgressColumn(), told, console=console, transient=True
    ) as bar:
        task = bar.add_task(doing, total=None, told="")

        def show(done: float, total: float, now: str = "") -> None:
            left_s = time_left.update(done, total, now)
            told = [f"{done:.0f} of {total:.0f}"] if counts and total else []
            told += [about_left(left_s)] if left_s else []
            total_share = 1.0 if total else None
            bar.update(
                task, completed=time_left.share, total=total_share, description=now or doing, told=", ".join(told)
            )

        with watch_compiling(lambda words: show(0, 0, words)), watched(show):
            yield
