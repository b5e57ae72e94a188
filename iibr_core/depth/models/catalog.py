"""Depth models on this machine by name, file or folder, and how to get one. Loads no model."""

from __future__ import annotations

import filecmp
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from platformdirs import user_data_path

from iibr_core.color import photo_in_srgb
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.models import cache, onnx, torch_models
from iibr_core.depth.models.download import download, local_folder
from iibr_core.depth.models.known import KNOWN_MODELS, USUAL_MODEL, KnownModel, Runner, missing_package
from iibr_core.depth.models.preparation import CONFIG, PREPROCESSOR, read_object
from iibr_core.formats.files import entries_of, is_file, is_folder
from iibr_core.formats.outputs import write_folder
from iibr_core.runtime.work import report_progress
from iibr_core.types import InputError, Photo

ONNX_KINDS = (None, "depth_anything", "dpt")
"""Model types, of folders with both kinds of weights, whose ONNX file is taken."""
UNSPECIFIC_NAMES = ("model", "onnx")
"""Stems of files that are named after their folders, as those from the Hugging Face hub are."""


@dataclass(frozen=True)
class LocalModel:
    """A model on this machine. weights: its file and the files beside it that hold its numbers, or those in a folder.

    is_meaning_known: whether the meaning of its estimates is certain.
    """

    title: str
    folder: Path
    runner: Runner
    weights: tuple[Path, ...]
    is_meaning_known: bool = True

    def estimate(self, photo: Photo) -> DepthEstimate:
        """Return the depth of a photo at a size of the model's choice, from the cache if it is there.

        Raises InputError if the model cannot be used, or its result is of no use.
        """
        photo = photo_in_srgb(photo)
        report_progress(0, 0, f"looking for an earlier estimate by {self.title}")
        key = cache.key_of(photo.pixels, (self.folder / CONFIG, self.folder / PREPROCESSOR, *self.weights))
        found = cache.load(key)
        if found is None:
            match self.runner:
                case "onnx":
                    found = onnx.estimate_onnx(self.weights[0], self.folder, self.title, photo)
                case "transformers":
                    found = torch_models.estimate_transformers(self.folder, self.title, photo)
                case "unidepth":
                    found = torch_models.estimate_unidepth(self.folder, self.title, photo)
            self._require_use(found)
            cache.store(key, found)
        return found

    def _require_use(self, found: DepthEstimate) -> None:
        values = found.values
        known = values[~np.isnan(values)] if self.runner == "unidepth" else values
        if not known.size or not np.isfinite(known).all():
            raise InputError(f"{self.title} gave NaN or infinity for this photo")
        if found.is_metric and not (known > 0).any():
            raise InputError(f"{self.title} gave no distance above 0 for this photo")
        if known.max() == known.min():
            raise InputError(f"{self.title} gave the same depth everywhere")


def known_model(name: str) -> KnownModel:
    """Return the known model of a name. Raises InputError with all names there are."""
    for model in KNOWN_MODELS:
        if model.name == name:
            return model
    names = ", ".join([*(model.name for model in KNOWN_MODELS), *list_own_models()])
    raise InputError(f"{name}: no depth model of this name is known; there are {names}")


def model_to_use(choice: DepthChoice) -> LocalModel | None:
    """Return the model that the user wants: a folder, an ONNX file, the name of a copied or a known one.

    Without a wish, return the usual one if it is ready, else None. Raises InputError if the wanted one is not here, or
    lacks its package.
    """
    wanted = choice.model
    if wanted is None:
        usual = known_model(USUAL_MODEL)
        found = None if usual.needs else model_here(usual)
        if found is None and choice.asks_for_model:
            raise InputError(f"--depth model: none is on this machine; get one with: iibr models get {USUAL_MODEL}")
        return found
    path = Path(os.path.expanduser(wanted))
    if is_folder(path) or is_file(path):
        return _model_at(path)
    if "/" in wanted or "\\" in wanted or path.suffix.lower() == ".onnx":
        raise InputError(f"{wanted}: no such file or folder")
    if wanted in list_own_models():
        return _model_at(list_own_models()[wanted], wanted)
    model = known_model(wanted)
    found = model_here(model)
    if found is None:
        raise InputError(f"{wanted} is not on this machine; get it with: iibr models get {wanted}")
    _require_installed(found)
    return found


def model_here(model: KnownModel) -> LocalModel | None:
    """Return a known model if all of its files are in the Hugging Face cache, else None."""
    folder = local_folder(model.repository, model.commit)
    if not all(is_file(folder / name) for name in model.files):
        return None
    return LocalModel(model.title, folder, model.runner, (folder / model.files[-1],))


def fetch(model: KnownModel) -> LocalModel:
    """Download a model into the Hugging Face cache. Raises as `download` does."""
    download(model.repository, model.commit, model.files, model.megabytes * 1e6)
    found = model_here(model)
    assert found is not None
    return found


def own_models_folder() -> Path:
    """Return the folder with one folder for each copied model; it may not exist yet."""
    return user_data_path("iibr", appauthor=False) / "models"


def list_own_models() -> dict[str, Path]:
    """Return the ONNX files of the copied models by name. Raises InputError if they cannot be listed."""
    place = own_models_folder()
    folders = entries_of(place) if is_folder(place) else []
    files = {folder.name: folder / f"{folder.name}.onnx" for folder in folders}
    return {name: file for name, file in files.items() if is_file(file)}


def register(path: Path) -> LocalModel:
    """Copy an ONNX file, or the one in a folder, with its files of weights and settings to where its name finds it.

    Nothing happens if the same file is there already. Raises InputError if it is no model that takes one picture, its
    name is taken, or it cannot be written.
    """
    if not (is_folder(path) or is_file(path)):
        raise InputError(f"{path}: no such file or folder")
    model = _model_at(path)
    if model.runner != "onnx":
        raise InputError(f"{path}: only ONNX files are copied; use this folder as it is with --depth-model {path}")
    file = model.weights[0].resolve()
    onnx.picture_input(onnx.open_session(file), file)
    name = model.folder.resolve().name if file.stem in UNSPECIFIC_NAMES else file.stem
    if any(known.name == name for known in KNOWN_MODELS):
        raise InputError(f"{path}: {name} is the name of a published model; rename the file")
    copy = own_models_folder() / name / f"{name}.onnx"
    if not copy.parent.exists():
        files = {weights: str(weights.relative_to(file.parent)) for weights in onnx.external_files(file)}
        files |= {model.folder / name: name for name in (CONFIG, PREPROCESSOR) if is_file(model.folder / name)}
        files[file] = copy.name
        with write_folder(copy.parent) as unfinished:
            for source, target in files.items():
                (unfinished / target).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, unfinished / target)
    elif not is_file(copy) or not filecmp.cmp(file, copy, shallow=False):
        raise InputError(f"{copy.parent}: another model has this name; rename {file}, or delete that folder")
    return _model_at(copy, name)


def _model_at(path: Path, name: str = "") -> LocalModel:
    """Return the model in a user's folder, or of a user's file."""
    title = f"the model {name or path.name}" if is_file(path) else f"the model in {path.name or path}"
    if is_file(path) and path.suffix.lower() != ".onnx":
        raise InputError(
            f"{path}: is not an ONNX file; --depth-model takes one, a model's folder, or a name `iibr models` lists"
        )
    files = [path] if is_file(path) else sorted(path.glob("*.onnx")) + sorted(path.glob("onnx/*.onnx"))
    config = {} if is_file(path) else read_object(path / CONFIG)
    kind = config.get("model_type")
    if files and kind in ONNX_KINDS:
        file = _only_file(path, files)
        # The hub lays files out in a folder "onnx" below their settings.
        folder = file.parent.parent if file.parent.name == "onnx" else file.parent
        model = LocalModel(title, folder, "onnx", (file, *onnx.external_files(file)), is_meaning_known=False)
    elif not config:
        raise InputError(f"{path}: holds no {CONFIG}; get the whole model folder")
    elif kind in torch_models.PREPARATIONS:
        model = LocalModel(title, path, "transformers", torch_models.safetensors_in(path))
    elif "unidepth" in str(config).lower():
        model = LocalModel(title, path, "unidepth", torch_models.safetensors_in(path))
    else:
        raise InputError(f"{path}: no known models are of its type, {kind!r}")
    _require_installed(model)
    return model


def _only_file(path: Path, files: list[Path]) -> Path:
    """Return the only ONNX file, or `model.onnx` of several. Raises InputError if that leaves a choice."""
    full = [file for file in files if file.name == "model.onnx"]
    if len(files) != 1 and len(full) != 1:
        names = ", ".join(file.name for file in files[:3])
        raise InputError(f"{path}: which ONNX file is meant ({names})? Name it with --depth-model {path}/FILE.onnx")
    return (full or files)[0]


def _require_installed(model: LocalModel) -> None:
    if package := missing_package(model.runner):
        raise InputError(f"{model.title} needs the package {package}")
