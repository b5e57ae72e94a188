"""The `iibr` command and its subcommands. Heavy modules are imported when a command runs."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from iibr_core.types import InputError
from viewer.cli.messages import print_notes
from viewer.cli.version import print_version

COMMANDS = {
    "view": "view.view",
    "export": "export.export",
    "screenshot": "screenshot.screenshot",
    "generate": "generate.generate",
    "depth": "depth.depth",
    "batch": "batch.batch",
    "plan": "plan.plan",
    "demo": "demo.demo",
    "evaluate": "evaluate.evaluate",
    "train": "train.train",
    "open": "open.open_photos",
    "models": "models.models",
}
"""Subcommands in the order of the help: file of this folder and name in it."""
FORMER_NAMES = {"--out": "--output"}
"""Former names of options, which scripts still use."""
FORMER_OPTIONS = ("--quality", "--memory")
"""Options of earlier versions, each with a value, which are ignored."""


@cache
def _load(name: str) -> Any:
    """Import a subcommand and return it as Typer runs it."""
    file, _, attribute = COMMANDS[name].partition(".")
    found = getattr(import_module(f"viewer.cli.{file}"), attribute)
    if not isinstance(found, typer.Typer):
        function, found = found, typer.Typer(add_completion=False, rich_markup_mode="rich")
        found.command(name)(function)
    return typer.main.get_command(found)


class Loaded(Mapping[str, Any]):
    """The subcommands by name; each is imported when it is looked up."""

    def __getitem__(self, name: str) -> Any:
        return _load(name)

    def __contains__(self, name: object) -> bool:
        return name in COMMANDS

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


class Commands(TyperGroup):
    """The subcommands. A path in place of a subcommand is viewed."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = Loaded()  # type: ignore[assignment]  # it is only read

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
    from viewer.cli.view import open_last_scene

    try:
        open_last_scene()
    except InputError as error:
        print(context.get_help())
        print_notes(str(error))
