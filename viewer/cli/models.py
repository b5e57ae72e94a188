"""`iibr models`: list the depth models that are known and which of them are here; fetch one."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from iibr_core.types import InputError

if TYPE_CHECKING:
    from iibr_core.depth.models.catalog import KnownModel

EXIT_DECLINED = 1
NOBODY_ANSWERS = "nobody answers whether to download it (end of input): say --yes"

models = typer.Typer(invoke_without_command=True, help="Depth models: list them, or get one.")


@models.callback()
def list_models(context: typer.Context) -> None:
    """List the depth models that are known, and which are on this machine.

    Example: iibr models
    """
    if context.invoked_subcommand is not None:
        return
    from iibr_core.depth.models.catalog import KNOWN_MODELS

    names = max(len(model.name) for model in KNOWN_MODELS)
    for model in KNOWN_MODELS:
        size = f"{model.megabytes:,} MB"
        print(f"{model.name:{names}}  {size:>8}  {_state(model):12}  {model.licence}")
    print("Get one: iibr models get NAME. Use one: --depth-model NAME; any other: --depth-model FILE.onnx, or FOLDER.")


@models.command()
def get(
    name: Annotated[str, typer.Argument(help="As `iibr models` lists it.")],
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Download a depth model, after telling its size and licence.

    Example: iibr models get depth-anything-v2-small
    """
    from iibr_core.depth.models.catalog import bytes_of, cached_folder, fetch, known_model, lacking_package

    model = known_model(name)
    folder = cached_folder(model)
    if folder is not None:
        print(f"{model.title} is here already: {folder}")
        return
    if not yes and _is_at_end(sys.stdin.buffer):
        raise InputError(NOBODY_ANSWERS)
    about = (
        f"{model.title}: about {model.megabytes:,} MB from huggingface.co/{model.repository}, licence {model.licence}"
    )
    print(about, file=sys.stderr)
    if not yes and not _agrees():
        print("Nothing was downloaded.", file=sys.stderr)
        raise typer.Exit(EXIT_DECLINED)
    folder = fetch(model)
    print(f"{folder} ({bytes_of(folder) / 1e6:,.0f} MB, commit {folder.name})")
    print(f"Use it: iibr view PHOTO --depth-model {model.name}")
    lacking = lacking_package(model.package)
    if lacking is not None:
        print(f"It also needs the package {lacking}: {model.install}")


def _is_at_end(file: Any) -> bool:
    """Whether nothing can come from it; a terminal is asked in earnest."""
    return not file.isatty() and not file.peek(1)


def _agrees() -> bool:
    try:
        return typer.confirm("Download it?", err=True)
    except typer.Abort as error:
        if isinstance(error.__context__, KeyboardInterrupt):
            raise
        print(file=sys.stderr)  # the question stands in the line still
        raise InputError(NOBODY_ANSWERS) from error


def _state(model: KnownModel) -> str:
    from iibr_core.depth.models.catalog import cached_folder, lacking_package

    if cached_folder(model) is None:
        return "not here"
    lacking = lacking_package(model.package)
    return "here" if lacking is None else f"lacks {lacking}"
