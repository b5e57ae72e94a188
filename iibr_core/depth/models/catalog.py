"""Depth models on this machine by name, file or folder, and how to get one. Loads no model."""

from __future__ import annotations

import filecmp
import os
import shutil
import time
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
from iibr_core.depth.models.preparation import CONFIG, PREPROCESSOR, USUAL_PREPARATION, Preparation, read_object
from iibr_core.formats.files import entries_of
from iibr_core.formats.outputs import write_folder
from iibr_core.remedies import FixableError, Remedy
from iibr_core.runtime.work import report_progress
from iibr_core.types import InputError, Photo


@dataclass(frozen=True)
class LocalModel:
    """A model on this machine. weights: its file and the files beside it that hold its numbers, or those in a folder.

    name: finds it, a path for files and folders. is_meaning_known: whether the meaning of its estimates is certain.
    preparation: of the photo, where no file beside the weights states it.
    """

    name: str
    title: str
    folder: Path
    runner: Runner
    weights: tuple[Path, ...]
    is_meaning_known: bool = True
    preparation: Preparation = USUAL_PREPARATION

    def estimate(self, photo: Photo) -> DepthEstimate:
        """Return the depth of a photo at a size of the model's choice, from the cache if it is there.

        Raises InputError if the model cannot be used, or its result is of no use.
        """
        photo = photo_in_srgb(photo)
        report_progress(0, 0, f"looking for an earlier estimate by {self.title}")
        key = cache.key_of(photo.pixels, (self.folder / CONFIG, self.folder / PREPROCESSOR, *self.weights))
        found, began = cache.load(key), time.perf_counter()
        if found is None:
            match self.runner:
                case "onnx":
                    found = onnx.estimate_onnx(self.weights[0], self.folder, self.title, photo, self.preparation)
                case "transformers":
                    found = torch_models.estimate_transformers(self.folder, self.title, photo)
                case "unidepth":
                    found = torch_models.estimate_unidepth(self.folder, self.title, photo)
            _require_use(found, self.title)
            cache.store(key, found)
            cache.note_seconds(self.name, time.perf_counter() - began)
        return found


def known_model(name: str) -> KnownModel:
    """Return the known model of a name. Raises InputError with all names there are."""
    known = {model.name: model for model in KNOWN_MODELS}
    if name not in known:
        names = ", ".join([*known, *list_own_models()])
        raise InputError(f"{name}: no depth model of this name is known; there are {names}")
    return known[name]


def model_to_use(choice: DepthChoice) -> LocalModel | None:
    """Return the model that the user wants; without a wish, a model that is ready, None if there is none.

    Raises InputError if the wanted one is not here, or lacks its package.
    """
    if choice.model is not None:
        return wanted_model(choice.model)
    found = model_at_hand()
    if found is None and choice.asks_for_model:
        raise FixableError(f"the depth model {USUAL_MODEL} is not on this machine", Remedy.DEPTH)
    return found


def model_at_hand() -> LocalModel | None:
    """Return the first published model that is here and runs as installed, else the first copied one, None if none."""
    runnable = (model_here(model) for model in KNOWN_MODELS if model.runs_as_installed and not model.needs)
    found = next((model for model in runnable if model is not None), None)
    if found is not None or missing_package("onnx"):
        return found
    return next((wanted_model(name) for name in list_own_models()), None)


def model_here(model: KnownModel) -> LocalModel | None:
    """Return a known model if all of its files are in the Hugging Face cache, else None."""
    folder = local_folder(model)
    if not all((folder / name).is_file() for name in model.files):
        return None
    weights = (folder / model.files[-1],)
    return LocalModel(model.name, model.title, folder, model.runner, weights, preparation=model.preparation)


def fetch(model: KnownModel) -> LocalModel:
    """Download a model into the Hugging Face cache. Raises as `download` does."""
    download(model)
    found = model_here(model)
    assert found is not None
    return found


def own_models_folder() -> Path:
    """Return the folder with one folder for each copied model; it may not exist yet."""
    return user_data_path("iibr", appauthor=False) / "models"


def list_own_models() -> dict[str, Path]:
    """Return the ONNX files of the copied models by name. Raises InputError if they cannot be listed."""
    place = own_models_folder()
    folders = entries_of(place) if place.is_dir() else []
    files = {folder.name: folder / f"{folder.name}.onnx" for folder in folders}
    return {name: file for name, file in files.items() if file.is_file()}


def register(path: Path) -> LocalModel:
    """Copy an ONNX file, or the one in a folder, with its files of weights and settings to where its name finds it.

    Nothing happens if the same file is there already. Raises InputError if it is no model that takes one picture, its
    name is taken, or it cannot be written.
    """
    model = wanted_model(str(path))
    if model.runner != "onnx":
        raise InputError(f"{path}: only ONNX files are copied; use this folder itself as the depth model")
    file = model.weights[0].resolve()
    onnx.picture_input(onnx.open_session(file), file)
    # Models from the Hugging Face hub are named after their folders.
    name = model.folder.resolve().name if file.stem in ("model", "onnx") else file.stem
    if any(known.name == name for known in KNOWN_MODELS):
        raise InputError(f"{path}: {name} is the name of a published model; rename the file")
    copy = own_models_folder() / name / f"{name}.onnx"
    if not copy.parent.exists():
        files = {weights: str(weights.relative_to(file.parent)) for weights in onnx.external_files(file)}
        files |= {model.folder / name: name for name in (CONFIG, PREPROCESSOR) if (model.folder / name).is_file()}
        files[file] = copy.name
        with write_folder(copy.parent) as unfinished:
            for source, target in files.items():
                (unfinished / target).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, unfinished / target)
    elif not copy.is_file() or not filecmp.cmp(file, copy, shallow=False):
        raise InputError(f"{copy.parent}: another model has this name; rename {file}, or delete that folder")
    return wanted_model(name)


def wanted_model(wanted: str) -> LocalModel:
    """Return the model in a folder, of an ONNX file, or of the name of a copied or a known one.

    Raises InputError if there is none, or it lacks its package.
    """
    path = Path(os.path.expanduser(wanted))
    if path.is_dir():
        found = _model_in(path, wanted)
    elif path.suffix.lower() == ".onnx" and path.is_file():
        found = _onnx_model(path, wanted, f"the model {path.name}")
    elif path.is_file():
        raise InputError(f"{path}: is not an ONNX file; give one, a model folder, or the name of a known model")
    elif "/" in wanted or "\\" in wanted or path.suffix.lower() == ".onnx":
        raise InputError(f"{wanted}: no such file or folder")
    elif wanted in (copied := list_own_models()):
        found = _onnx_model(copied[wanted], wanted, f"the model {wanted}")
    else:
        return _known_model_here(known_model(wanted))
    _require_package(found.runner, found.title)
    return found


def _known_model_here(known: KnownModel) -> LocalModel:
    """Return a known model. What it needs is named before it is downloaded."""
    _require_package(known.runner, known.title)
    found = model_here(known)
    if found is None:
        raise FixableError(f"the depth model {known.name} is not on this machine", Remedy.DEPTH)
    return found


def _require_package(runner: Runner, title: str) -> None:
    package = missing_package(runner)
    if package:
        raise InputError(f"{title} needs the package {package}")


def _model_in(folder: Path, name: str) -> LocalModel:
    """Return the model in a user's folder."""
    title, config = f"the model in {folder.name or folder}", read_object(folder / CONFIG)
    kind, files = config.get("model_type"), sorted([*folder.glob("*.onnx"), *folder.glob("onnx/*.onnx")])
    if files and kind in (None, "depth_anything", "dpt"):  # other kinds' ONNX files do not state that they give metres
        full = [file for file in files if file.name == "model.onnx"]
        if 1 not in (len(files), len(full)):
            names = ", ".join(file.name for file in files[:3])
            raise InputError(f"{folder}: holds several ONNX files ({names}); give one of them")
        return _onnx_model((full or files)[0], name, title)
    if not config:
        raise InputError(f"{folder}: holds no {CONFIG}; get the whole model folder")
    if kind not in torch_models.PREPARATIONS and "unidepth" not in str(config).lower():
        raise InputError(f"{folder}: no known models are of its type, {kind!r}")
    runner: Runner = "transformers" if kind in torch_models.PREPARATIONS else "unidepth"
    return LocalModel(name, title, folder, runner, torch_models.safetensors_in(folder))


def _require_use(found: DepthEstimate, title: str) -> None:
    known = found.values[~np.isnan(found.values)]
    if not known.size or not np.isfinite(known).all():
        raise InputError(f"{title} gave NaN or infinity for this photo")
    if found.is_metric and not (known > 0).any():
        raise InputError(f"{title} gave no distance above 0 for this photo")
    if known.max() == known.min():
        raise InputError(f"{title} gave the same depth everywhere")


def _onnx_model(file: Path, name: str, title: str) -> LocalModel:
    """Return the model of an ONNX file. The hub lays such files out in a folder "onnx" below their settings."""
    folder = file.parent.parent if file.parent.name == "onnx" else file.parent
    return LocalModel(name, title, folder, "onnx", (file, *onnx.external_files(file)), is_meaning_known=False)
