"""The `iibr` command: which commands there are, and how bad input and interruption end. Heavy imports wait."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from iibr_core.formats.unfinished import CLAIMS
from iibr_core.runtime.allocator import limit_arenas
from iibr_core.types import InputError
from viewer.cli.batch import batch
from viewer.cli.demo_command import demo
from viewer.cli.depth_command import depth
from viewer.cli.evaluate import evaluate
from viewer.cli.export import export
from viewer.cli.generate import generate
from viewer.cli.models import models
from viewer.cli.plan_command import plan
from viewer.cli.screenshot import screenshot
from viewer.cli.terminal import Commands, print_notes
from viewer.cli.train import train
from viewer.cli.view_command import open_window, view

UsageError: Any = typer.BadParameter.__base__
"""Click's, wherever this typer keeps it."""

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130

app = typer.Typer(
    name="iibr",
    cls=Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
for command in (view, export, screenshot, generate, depth, batch, plan, demo, evaluate, train):
    app.command()(command)
app.add_typer(models, name="models")


def main() -> None:
    """Run the command line. Bad input ends in one line on stderr and exit code 2, interruption in one and 130."""
    limit_arenas()
    try:
        sys.exit(app(standalone_mode=False) or 0)
    except UsageError as error:
        _end(str(error.format_message()) + " (--help tells more)", EXIT_BAD_INPUT)
    except InputError as error:
        _end(str(error), EXIT_BAD_INPUT)
    except MemoryError as error:
        _end(f"out of memory ({error}): lower --max-pixels, or the --grid", EXIT_BAD_INPUT)
    except (KeyboardInterrupt, typer.Abort):
        _end("interrupted", EXIT_INTERRUPTED)
    finally:
        CLAIMS.release_all()


def _end(message: str, code: int) -> None:
    print(f"iibr: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(code)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"iibr {version('iibr')}")
        raise typer.Exit


@app.callback()
def iibr(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show it.")
    ] = False,
) -> None:
    """One photo becomes a light field you can hold: drag the viewpoint, click to refocus, open the aperture.

    `iibr photo.jpg` opens it, `iibr` what was open last.
    """
    if context.invoked_subcommand is not None:
        return
    try:
        open_window()
    except InputError as error:
        print(context.get_help())
        print_notes((str(error),))


@app.command(hidden=True, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def bench() -> None:
    """Measure the program itself: no longer a command, but part of the source.

    Example: make bench
    """
    raise InputError("bench measures the program itself; in its source, run: make bench DATA=FOLDER OUT=FOLDER")
