"""`iibr models`: list the depth models that are known and which of them are here; fetch one, or copy one's own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from iibr_core.types import InputError
from viewer.cli.terminal import show_progress

EXIT_DECLINED = 1
NOBODY_ANSWERS = "nobody answers whether to download it (end of input): say --yes"

models = typer.Typer(invoke_without_command=True, help="Depth models: list them, or get one.")


@models.callback()
def list_models(context: typer.Context) -> None:
    """List the depth models that are known, which are on this machine, and those of your own.

    Example: iibr models
    """
    if context.invoked_subcommand is not None:
        return
    from iibr_core.depth.estimators.catalog import KNOWN_MODELS, state_of
    from iibr_core.depth.estimators.own_models import list_own_models
    from iibr_core.depth.estimators.words import words_about

    own = list_own_models()
    names = max(map(len, [*(model.name for model in KNOWN_MODELS), *own]))
    for model in KNOWN_MODELS:
        words = words_about(model, state_of(model))
        print(f"{model.name:{names}}  {words.figures}, {words.place}")
        for line in filter(None, (words.good_for, words.needs)):
            print(f"{'':{names}}  {line}")
    for name, file in own.items():
        print(f"{name:{names}}  {file.stat().st_size / 1e6:,.0f} MB, your own, {file}")
    print("Get one: iibr models get NAME, or FILE.onnx for a model of your own, which is copied.")
    print("Use one: --depth-model NAME, or FILE.onnx, or FOLDER.")


@models.command()
def get(
    name: Annotated[str, typer.Argument(help="As `iibr models` lists it, or an ONNX file of your own.")],
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Download a depth model, after telling its size and licence; an ONNX file is copied to the models of your own.

    Example: iibr models get depth-anything-v2-small
    """
    from iibr_core.depth.estimators.catalog import KNOWN_MODELS, fetch, known_model, model_here, state_of
    from iibr_core.depth.estimators.words import words_about

    is_published = any(model.name == name for model in KNOWN_MODELS)
    if not is_published and (Path(name).suffix.lower() == ".onnx" or Path(name).exists()):
        _copy(Path(name))
        return
    model = known_model(name)
    found = model_here(model)
    if found is not None:
        print(f"{model.title} is here already: {found.folder}")
        return
    if not yes and _is_at_end(sys.stdin.buffer):
        raise InputError(NOBODY_ANSWERS)
    words = words_about(model, state_of(model))
    about = f"{model.title}: {words.figures}; from huggingface.co/{model.repository}."
    print(" ".join(filter(None, (about, words.good_for, words.needs))), file=sys.stderr)
    if not yes and not _agrees():
        print("Nothing was downloaded.", file=sys.stderr)
        raise typer.Exit(EXIT_DECLINED)
    with show_progress("downloading"):
        fetched = fetch(model)
    print(f"{fetched.folder} ({fetched.weight_bytes / 1e6:,.0f} MB, commit {model.commit})")
    print(f"Use it: iibr view PHOTO --depth-model {model.name}")


def _copy(path: Path) -> None:
    from iibr_core.depth.estimators.catalog import register

    model = register(path)
    print(f"{model.folder} ({model.weight_bytes / 1e6:,.0f} MB)")
    print(f"Use it: iibr view PHOTO --depth-model {model.folder.name}")


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
