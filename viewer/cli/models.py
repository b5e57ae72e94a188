"""`iibr models`: list the depth models that are known and which of them are here; fetch one, or copy one's own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from iibr_core.types import InputError
from viewer.cli.terminal import show_progress

EXIT_DECLINED = 1
NO_ANSWER = "nobody answers whether to download it (end of input): say --yes"

models = typer.Typer(invoke_without_command=True, help="Depth models: list them, or get one.")


@models.callback()
def list_models(context: typer.Context) -> None:
    """List the depth models that are known, which are on this machine, and those of your own.

    Example: iibr models
    """
    if context.invoked_subcommand is not None:
        return
    from iibr_core.depth.models.catalog import list_own_models, model_here
    from iibr_core.depth.models.known import KNOWN_MODELS

    copied = list_own_models()
    names = max(map(len, [*(model.name for model in KNOWN_MODELS), *copied]))
    for model in KNOWN_MODELS:
        print(f"{model.name:{names}}  {model.figures}, {'here' if model_here(model) else 'not here'}")
        for line in filter(None, (model.advice, model.needs)):
            print(f"{'':{names}}  {line}")
    for name, file in copied.items():
        print(f"{name:{names}}  {file.stat().st_size / 1e6:,.0f} MB, your own, {file}")
    print("Get one: iibr models get NAME, or FILE.onnx for a model of your own, which is copied.")
    print("Use one: --depth-model NAME, or FILE.onnx, or FOLDER.")


@models.command()
def get(
    name: Annotated[str, typer.Argument(help="As `iibr models` lists it, or an ONNX file of your own.")],
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Download a depth model, after showing its size and licence; an ONNX file is copied to the models of your own.

    Example: iibr models get depth-anything-v2-small
    """
    from iibr_core.depth.models.catalog import fetch, known_model, model_here, register
    from iibr_core.depth.models.known import KNOWN_MODELS

    is_published = any(model.name == name for model in KNOWN_MODELS)
    if not is_published and (Path(name).suffix.lower() == ".onnx" or Path(name).exists()):
        copy = register(Path(name))
        print(copy.folder)
        print(f"Use it: iibr view PHOTO --depth-model {copy.folder.name}")
        return
    model = known_model(name)
    found = model_here(model)
    if found is not None:
        print(f"{model.title} is here already: {found.folder}")
        return
    if not yes and _is_at_end(sys.stdin.buffer):
        raise InputError(NO_ANSWER)
    description = f"{model.title}: {model.figures}; from huggingface.co/{model.repository}."
    print(" ".join(filter(None, (description, model.advice, model.needs))), file=sys.stderr)
    if not yes and not _agrees():
        print("Nothing was downloaded.", file=sys.stderr)
        raise typer.Exit(EXIT_DECLINED)
    with show_progress("downloading"):
        fetched = fetch(model)
    print(f"{fetched.folder} (commit {model.commit})")
    print(f"Use it: iibr view PHOTO --depth-model {model.name}")


def _is_at_end(file: Any) -> bool:
    """Return whether nothing can come from a file; a terminal is asked in earnest."""
    return not file.isatty() and not file.peek(1)


def _agrees() -> bool:
    try:
        return typer.confirm("Download it?", err=True)
    except typer.Abort as error:
        if isinstance(error.__context__, KeyboardInterrupt):
            raise
        print(file=sys.stderr)  # ends the line of the question
        raise InputError(NO_ANSWER) from error
