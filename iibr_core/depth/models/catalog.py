"""Depth models by name: published ones, those on this machine, and how to get one. Loads no model."""

from __future__ import annotations

import filecmp
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from platformdirs import user_data_path

from iibr_core.color import photo_in_srgb
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.models import cache, onnx, torch_models
from iibr_core.depth.models.download import download, local_folder
from iibr_core.depth.models.preparation import CONFIG, PREPROCESSOR, read_object
from iibr_core.formats.files import entries_of, is_file, is_folder
from iibr_core.formats.outputs import write_folder
from iibr_core.runtime.extras import is_installed
from iibr_core.runtime.work import report_progress
from iibr_core.types import InputError, Photo

Runner = Literal["onnx", "transformers", "unidepth"]
PACKAGES: dict[Runner, tuple[str, ...]] = {
    "onnx": ("onnxruntime",),
    "transformers": ("transformers", "torch"),
    "unidepth": ("unidepth", "torch"),
}
INSTALLING: dict[Runner, str] = {
    "onnx": "use Python 3.11 to 3.14, later ones have no package of it yet",
    "transformers": "pip install 'iibr[depth]'",
    "unidepth": "follow github.com/lpiccinelli-eth/UniDepth",
}
ONNX_FILES = (CONFIG, PREPROCESSOR, "onnx/model.onnx")
TORCH_FILES = (CONFIG, PREPROCESSOR, "model.safetensors")
ONNX_KINDS = (None, "depth_anything", "dpt")
"""Model types, of folders with both kinds of weights, whose ONNX file is taken."""
UNSPECIFIC_NAMES = ("model", "onnx")
"""Stems of files that are named after their folders, as those from the Hugging Face hub are."""


@dataclass(frozen=True)
class KnownModel:
    """A published model.

    repository: on the Hugging Face hub; commit: of it, in full, the only one that is downloaded. megabytes: of the
    weights, about. good_for: in a few words. is_recommended: true for one model.
    """

    name: str
    title: str
    repository: str
    commit: str
    files: tuple[str, ...]
    megabytes: int
    licence: str
    good_for: str
    is_recommended: bool = False

    @property
    def figures(self) -> str:
        """Size and licence, for lists."""
        return f"{self.megabytes:,} MB, {self.licence}"

    @property
    def advice(self) -> str:
        """Purpose, and whether it is recommended, for lists."""
        return f"Good for {self.good_for}." + (" Recommended." if self.is_recommended else "")

    @property
    def needs(self) -> str:
        """A sentence about the package that must be installed first, "" if none must."""
        package = _missing_package("onnx" if self.files == ONNX_FILES else "transformers")
        return f"Needs the package {package}." if package else ""


@dataclass(frozen=True)
class LocalModel:
    """A model on this machine. weights: its file and the files beside it that hold its numbers, or those in a folder.

    is_meaning_known: whether its output surely means what its estimates say.
    """

    title: str
    folder: Path
    runner: Runner
    weights: tuple[Path, ...]
    is_meaning_known: bool = True

    @property
    def weight_bytes(self) -> int:
        """Size of the weights on disk."""
        return sum(path.stat().st_size for path in self.weights)

    def estimate(self, photo: Photo) -> DepthEstimate:
        """Return the depth of a photo at a size of the model's choice, from the cache if it is there.

        Raises InputError if the model cannot be used, or its result says nothing about the photo.
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


KNOWN_MODELS = (
    KnownModel(
        "depth-anything-v2-small",
        "Depth Anything V2 Small",
        "onnx-community/depth-anything-v2-small",
        "64fe43eba7f8a384b02fe3fadaa26cbba35548d8",
        ONNX_FILES,
        99,
        "Apache-2.0",
        "any photo; the fastest",
        is_recommended=True,
    ),
    KnownModel(
        "depth-anything-v2-base",
        "Depth Anything V2 Base",
        "onnx-community/depth-anything-v2-base",
        "6db5e16b48d85e78c043e57f8411a23550edbbfc",
        ONNX_FILES,
        389,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; finer shapes than Small, slower",
    ),
    KnownModel(
        "depth-anything-v2-large",
        "Depth Anything V2 Large",
        "onnx-community/depth-anything-v2-large",
        "e5476ff1183c8cfb19fcf293a5904c7403e77695",
        ONNX_FILES,
        1340,
        "CC-BY-NC-4.0 (not for commercial use)",
        "any photo; the finest shapes of the three, the slowest",
    ),
    KnownModel(
        "depth-anything-v2-metric-indoor",
        "Depth Anything V2 Metric Indoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Indoor-Small-hf",
        "8078d68a9c75a972131914f6afd0c1723be0da7f",
        TORCH_FILES,
        99,
        "Apache-2.0",
        "rooms, where distances in metres matter",
    ),
    KnownModel(
        "depth-anything-v2-metric-outdoor",
        "Depth Anything V2 Metric Outdoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Outdoor-Small-hf",
        "fd2c22027eaf20374204f14099b8341e1925ad39",
        TORCH_FILES,
        99,
        "Apache-2.0",
        "streets and landscapes, where distances in metres matter",
    ),
    KnownModel(
        "depth-pro",
        "Depth Pro",
        "apple/DepthPro-hf",
        "de816c8ce7168afcb231f96d501d72b869d0beda",
        TORCH_FILES,
        1904,
        "Apple's model licence (for research)",
        "sharp outlines such as hair, and distances in metres; slow",
    ),
    KnownModel(
        "zoedepth",
        "ZoeDepth",
        "Intel/zoedepth-nyu-kitti",
        "f364d4c7936e91f465abba182208dd68142bf0ca",
        TORCH_FILES,
        1380,
        "MIT",
        "distances in metres, indoors and on streets, under a free licence",
    ),
    KnownModel(
        "midas-dpt-large",
        "MiDaS 3 (DPT large)",
        "Intel/dpt-large",
        "bc15f29aa3a80d532f2ed650b5e16ac48d8958f9",
        TORCH_FILES,
        1370,
        "Apache-2.0",
        "comparing with older work",
    ),
)
"""Sizes and licences as published; the repository has the last word."""
USUAL_MODEL = next(model.name for model in KNOWN_MODELS if model.is_recommended)


def known_model(name: str) -> KnownModel:
    """Return the known model of a name. Raises InputError with all names there are."""
    for model in KNOWN_MODELS:
        if model.name == name:
            return model
    names = ", ".join([*(model.name for model in KNOWN_MODELS), *list_own_models()])
    raise InputError(f"{name}: no depth model of this name is known; there are {names}")


def model_to_use(choice: DepthChoice) -> LocalModel | None:
    """Return the model that the user wants: a folder, an ONNX file, the name of a copied or a known one.

    Without a wish, return the usual one if it is ready, else None. Raises InputError if what is wanted is not here, or
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
    runner: Runner = "onnx" if model.files == ONNX_FILES else "transformers"
    return LocalModel(model.title, folder, runner, (folder / model.files[-1],))


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
        files = {
            file: copy.name,
            **{weights: str(weights.relative_to(file.parent)) for weights in onnx.external_files(file)},
        }
        files |= {model.folder / name: name for name in (CONFIG, PREPROCESSOR) if is_file(model.folder / name)}
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


def _missing_package(runner: Runner) -> str:
    """Return the first package that is not installed and how to get it, "" if all are."""
    missing = [package for package in PACKAGES[runner] if not is_installed(package)]
    return f"{missing[0]} first: {INSTALLING[runner]}" if missing else ""


def _require_installed(model: LocalModel) -> None:
    if package := _missing_package(model.runner):
        raise InputError(f"{model.title} needs the package {package}")
