"""Depth models by name: published ones, those on this machine, and how to download one. Loads no model."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimators import onnx_models
from iibr_core.depth.estimators.config import folder_of, read_config
from iibr_core.depth.estimators.depth_estimator import Family, KnownModel, LocalModel
from iibr_core.depth.estimators.download import download, verified_folder
from iibr_core.depth.estimators.estimate_cache import seconds_of
from iibr_core.depth.estimators.known_models import FAMILIES
from iibr_core.depth.estimators.own_models import copy_own_model, list_own_models, own_name
from iibr_core.depth.estimators.words import ModelState
from iibr_core.formats.files import is_file, is_folder
from iibr_core.types import InputError

KNOWN_MODELS = tuple(model for family in FAMILIES for model in family.models)
"""Sizes and licences as published; the repository itself has the last word."""

USUAL_MODEL = next(model.name for model in KNOWN_MODELS if model.is_recommended)


def known_model(name: str) -> KnownModel:
    """Raises InputError, naming those there are."""
    for model in KNOWN_MODELS:
        if model.name == name:
            return model
    names = ", ".join([*(model.name for model in KNOWN_MODELS), *list_own_models()])
    raise InputError(f"{name}: no depth model of this name is known; there are {names}")


def family_of(model: KnownModel) -> Family:
    """The family whose file lists a model."""
    return next(family for family in FAMILIES if model in family.models)


def model_to_use(choice: DepthChoice) -> LocalModel | None:
    """The model that the user wants (a folder, an ONNX file, the name of a copied or a known one), else the usual one
    if it is ready, else None.

    Raises InputError where what is wanted is not here, or the package that runs it is not installed.
    """
    wanted = choice.model
    if wanted is None:
        usual = known_model(USUAL_MODEL)
        found = model_here(usual) if family_of(usual).lacking_package() is None else None
        if found is None and choice.asks_for_model:
            raise InputError(f"--depth model: none is on this machine; get one with: iibr models get {USUAL_MODEL}")
        return found
    path = Path(os.path.expanduser(wanted))
    if is_folder(path) or is_file(path):
        return _model_at(path)
    if "/" in wanted or "\\" in wanted or path.suffix.lower() == ".onnx":
        raise InputError(f"{wanted}: no such file or folder")
    own = list_own_models().get(wanted)
    if own is not None:
        return _own_model(own)
    model = known_model(wanted)
    _require_installed(model.title, family_of(model))
    found = model_here(model)
    if found is None:
        raise InputError(f"{wanted} is not on this machine; get it with: iibr models get {wanted}")
    return found


def model_here(model: KnownModel) -> LocalModel | None:
    """A known model in the local Hugging Face cache, None where it is not there, or without weights."""
    folder = verified_folder(model.repository, model.commit)
    if folder is None:
        return None
    family = family_of(model)
    try:
        return LocalModel(model.title, folder, family, family.weights_in(folder))
    except InputError:
        return None


def register(path: Path) -> LocalModel:
    """Copy an ONNX file of one's own, or the one in a folder, to where its name finds it.

    Raises InputError where it is no model that takes one picture, or its name is taken.
    """
    if not (is_folder(path) or is_file(path)):
        raise InputError(f"{path}: no such file or folder")
    if _model_at(path).family is not onnx_models.FAMILY:
        raise InputError(f"{path}: only ONNX files are copied; use this folder as it is with --depth-model {path}")
    name = own_name(path)
    if any(model.name == name for model in KNOWN_MODELS):
        raise InputError(f"{path}: {name} is the name of a published model; rename the file")
    return _own_model(copy_own_model(path))


def is_meaning_known(model: LocalModel) -> bool:
    """Whether it is a known model, or of a family that says what its output means, rather than any ONNX file."""
    return model.family is not onnx_models.FAMILY or any(model.title == known.title for known in KNOWN_MODELS)


def state_of(model: KnownModel) -> ModelState:
    """What this machine has of a model. Takes half a second the first time."""
    family = family_of(model)
    lacking = family.lacking_package()
    needs = f"the package {lacking} first: {family.install}" if lacking is not None else ""
    return ModelState(model_here(model) is not None, needs, seconds_of(model.title))


def fetch(model: KnownModel) -> LocalModel:
    """Download a model into the local Hugging Face cache.

    Raises as `download` does, and InputError where it has no weights that may be read.
    """
    family = family_of(model)
    folder = download(model.repository, model.commit, family.fetched)
    return LocalModel(model.title, folder, family, family.weights_in(folder))


def _own_model(file: Path) -> LocalModel:
    return replace(_model_at(file), title=f"the model {file.stem}")


def _model_at(path: Path) -> LocalModel:
    """The model in a user's folder, or the one whose weights are a user's file."""
    family = next((family for family in FAMILIES if family.accepts(path)), None)
    if family is None and is_file(path):
        raise InputError(
            f"{path}: is not an ONNX file; --depth-model takes one, a model's folder, or a name `iibr models` lists"
        )
    if family is None:
        raise InputError(f"{path}: no known models are of its type, {read_config(path).get('model_type')!r}")
    _require_installed(str(path), family)
    title = f"the model in {path.name or path}" if is_folder(path) else f"the model {path.name}"
    return LocalModel(title, folder_of(path), family, family.weights_in(path))


def _require_installed(what: str, family: Family) -> None:
    lacking = family.lacking_package()
    if lacking is not None:
        raise InputError(f"{what} needs the package {lacking}, which is not installed: {family.install}")
