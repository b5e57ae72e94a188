"""The `iibr` command and its subcommands. Heavy modules are imported when a command runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from iibr_core.types import InputError
from viewer.cli.batch import batch
from viewer.cli.depth import depth
from viewer.cli.evaluate import evaluate
from viewer.cli.export import export
from viewer.cli.generate import generate
from viewer.cli.messages import print_notes
from viewer.cli.models import models
from viewer.cli.open import open_photos
from viewer.cli.plan import plan
from viewer.cli.screenshot import screenshot
from viewer.cli.train import train
from viewer.cli.version import print_version
from viewer.cli.view import demo, open_last_scene, view

FORMER_NAMES = {"--out": "--output"}
"""Former names of options, which scripts still use."""
FORMER_OPTIONS = ("--quality", "--memory")
"""Options of earlier versions, each with a value, which are ignored."""


class Commands(TyperGroup):
    """The subcommands. A path in place of a subcommand is viewed."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, the command and its arguments."""
        args = _with_present_names(args)
        word = args[0]
        is_path = os.path.exists(word) or bool(Path(word).suffix) or Path(word).name != word
        return super().resolve_command(ctx, ["view", *args] if word not in self.commands and is_path else args)


def _with_present_names(words: list[str]) -> list[str]:
    """Return the words of a command line without former options and with the present names of the others."""
    found, rest = [], iter(words)
    for word in rest:
        name, equals, value = word.partition("=")
        if name not in FORMER_OPTIONS:
            found.append(FORMER_NAMES.get(name, name) + equals + value)
        elif not equals:
            next(rest, None)
    return found


app = typer.Typer(
    name="iibr",
    cls=Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
for command in (view, export, screenshot, generate, depth, batch, plan, demo, evaluate, train):
    app.command()(command)
app.command("open")(open_photos)
app.add_typer(models, name="models")


@app.callback()
def iibr(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", metavar="", callback=print_version, is_eager=True, help="Show versions and commit."),
    ] = False,
) -> None:
    """One photo becomes a light field you can hold: drag the viewpoint, click to refocus, open the aperture.

    `iibr photo.jpg` opens a photo, `iibr` alone the last scene.
    """
    if context.invoked_subcommand is not None:
        return
    try:
        open_last_scene()
    except InputError as error:
        print(context.get_help())
        print_notes(str(error))
