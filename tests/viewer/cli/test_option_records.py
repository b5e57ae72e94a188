"""Records of options: typer sees their fields, the command gets them whole."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer
from typer.testing import CliRunner

from viewer.cli.option_records import with_option_records


@dataclass(frozen=True)
class Shape:
    width: Annotated[int, typer.Option()]
    color: Annotated[str, typer.Option("--colour", help="Of it.")] = "red"


@dataclass(frozen=True)
class Solid(Shape):
    depth: float = 1.0


got: list[object] = []


@with_option_records
def draw(name: Annotated[str, typer.Argument()], shape: Solid, times: int = 1, *, context: typer.Context) -> None:
    """Draw it."""
    got[:] = [name, shape, times, sorted(context.params)]


def run(*words: str) -> int:
    app = typer.Typer()
    app.command()(draw)
    return CliRunner().invoke(app, words).exit_code


def test_a_record_is_made_of_its_options() -> None:
    names = ["color", "depth", "name", "times", "width"]
    assert run("box", "--width", "3") == 0
    assert got == ["box", Solid(3, "red", 1.0), 1, names]
    assert run("box", "--times", "2", "--colour", "blue", "--depth", "0.5", "--width", "4") == 0
    assert got == ["box", Solid(4, "blue", 0.5), 2, names]


def test_what_has_no_default_must_be_given() -> None:
    assert run("box") == 2
