"""`iibr models`: list the depth models, download one, or add an ONNX file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from viewer.cli.messages import show_progress
from viewer.cli.option_records import flag

EXIT_DECLINED = 1

models = typer.Typer(name="models", invoke_without_command=True, add_completion=False)


@models.callback()
def list_models(context: typer.Context) -> None:
    """List the known depth models, those on this machine, and your own.

    Example: iibr models
    """
    if context.invoked_subcommand is not None:
        return
    from iibr_core.depth.models.catalog import list_own_models, model_here
    from iibr_core.depth.models.known import KNOWN_MODELS

    copied = list_own_models()
    width = max(map(len, [*(model.name for model in KNOWN_MODELS), *copied]))
    for model in KNOWN_MODELS:
        print(f"{model.name:{width}}  {model.figures}, {'here' if model_here(model) else 'not here'}")
        for line in filter(None, (model.advice, model.needs)):
            print(f"{'':{width}}  {line}")
    for name, file in copied.items():
        print(f"{name:{width}}  {file.stat().st_size / 1e6:,.0f} MB, your own, {file}")
    print("Get one: iibr models get NAME, or FILE.onnx to add a model of your own.")
    print("Use one: --depth-model NAME, or FILE.onnx, or FOLDER.")


@models.command()
def get(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Name in the list of `iibr models`, or an ONNX file of your own.")
    ],
    yes: Annotated[bool, flag("--yes", "Do not ask.")] = False,
) -> None:
    """Download a depth model, after showing its size and licence; an ONNX file is copied to your own models.

    Example: iibr models get depth-anything-v2-small
    """
    from iibr_core.depth.models.catalog import fetch, known_model, model_here, register
    from iibr_core.depth.models.known import KNOWN_MODELS

    is_known = any(model.name == name for model in KNOWN_MODELS)
    if not is_known and (Path(name).suffix.lower() == ".onnx" or Path(name).exists()):
        copy = register(Path(name))
        print(copy.folder)
        print(f"Use it: iibr view PHOTO --depth-model {copy.folder.name}")
        return
    model = known_model(name)
    here = model_here(model)
    if here is not None:
        print(f"{model.title} is here already: {here.folder}")
        return
    description = f"{model.title}: {model.figures}; from huggingface.co/{model.repository}."
    print(" ".join(filter(None, (description, model.advice, model.needs))), file=sys.stderr)
    if not yes and not typer.confirm("Download it?", err=True):
        print("Nothing was downloaded.", file=sys.stderr)
        raise typer.Exit(EXIT_DECLINED)
    with show_progress("downloading"):
        fetched = fetch(model)
    print(f"{fetched.folder} (commit {model.commit})")
    print(f"Use it: iibr view PHOTO --depth-model {model.name}")
