"""The `iibr` command: which commands there are. Heavy imports wait."""

from __future__ import annotations

from typing import Annotated

import typer

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
