"""Depth models by name: published ones, those on this machine, and how to download one. Loads no model.

Only ONNX and safetensors files are downloaded or read: pickled weights run code.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.models.download import download, verified_folder
from iibr_core.formats.files import is_file, is_folder
from iibr_core.runtime.extras import is_installed
from iibr_core.runtime.tiling import ShouldStop, never
from iibr_core.types import InputError, ReportProgress

ONNX, TRANSFORMERS = "onnxruntime", "transformers"
INSTALL_HINT = "pip install 'iibr[depth]'"
INSTALLS = {
    ONNX: "use Python 3.11 to 3.14, later ones have no package of it yet",
    "depth_anything_3": "pip install depth-anything-3",
    "unidepth": "follow github.com/lpiccinelli-eth/UniDepth",
}
"""How to get the packages that do not come with that."""


@dataclass(frozen=True)
class KnownModel:
    """A published model. repository: on the Hugging Face hub; commit: of it, in full: no other is downloaded.
    megabytes: of its weights, about. package: that runs it, as Python imports it. files: what is downloaded of it.
    """

    name: str
    title: str
    repository: str
    commit: str
    megabytes: int
    licence: str
    package: str = TRANSFORMERS
    files: tuple[str, ...] = ("*.json", "*.safetensors")

    @property
    def install(self) -> str:
        """How to get the package."""
        return INSTALLS.get(self.package, INSTALL_HINT)


USUAL_MODEL = "depth-anything-v2-small"

KNOWN_MODELS = (
    KnownModel(
        "depth-anything-v2-small",
        "Depth Anything V2 Small",
        "onnx-community/depth-anything-v2-small",
        "64fe43eba7f8a384b02fe3fadaa26cbba35548d8",
        99,
        "Apache-2.0",
        ONNX,
        ("config.json", "preprocessor_config.json", "onnx/model.onnx"),
    ),
    KnownModel(
        "depth-anything-v2-base",
        "Depth Anything V2 Base",
        "depth-anything/Depth-Anything-V2-Base-hf",
        "b1958afc87fb45a9e3746cb387596094de553ed8",
        390,
        "CC-BY-NC-4.0 (not for commercial use)",
    ),
    KnownModel(
        "depth-anything-v2-large",
        "Depth Anything V2 Large",
        "depth-anything/Depth-Anything-V2-Large-hf",
        "7581137eff8d4e94f6e796d3baea0e9fa79b22d2",
        1341,
        "CC-BY-NC-4.0 (not for commercial use)",
    ),
    KnownModel(
        "depth-anything-v2-metric-indoor",
        "Depth Anything V2 Metric Indoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Indoor-Small-hf",
        "8078d68a9c75a972131914f6afd0c1723be0da7f",
        99,
        "Apache-2.0",
    ),
    KnownModel(
        "depth-anything-v2-metric-outdoor",
        "Depth Anything V2 Metric Outdoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Outdoor-Small-hf",
        "fd2c22027eaf20374204f14099b8341e1925ad39",
        99,
        "Apache-2.0",
    ),
    KnownModel(
        "depth-pro",
        "Depth Pro",
        "apple/DepthPro-hf",
        "de816c8ce7168afcb231f96d501d72b869d0beda",
        1904,
        "Apple's model licence (for research)",
    ),
    KnownModel(
        "zoedepth",
        "ZoeDepth",
        "Intel/zoedepth-nyu-kitti",
        "f364d4c7936e91f465abba182208dd68142bf0ca",
        1380,
        "MIT",
    ),
    KnownModel(
        "midas-dpt-large",
        "MiDaS 3 (DPT large)",
        "Intel/dpt-large",
        "bc15f29aa3a80d532f2ed650b5e16ac48d8958f9",
        1370,
        "Apache-2.0",
    ),
    KnownModel(
        "depth-anything-3-small",
        "Depth Anything 3 Small",
        "depth-anything/DA3-SMALL",
        "e08cab65ca0ec38e7826075418411ab90cab4da3",
        138,
        "Apache-2.0",
        "depth_anything_3",
    ),
)
"""Sizes and licences as published; the repository itself has the last word."""


@dataclass(frozen=True)
class LocalModel:
    """A model on this machine. package: the Python package that runs it. file: the ONNX file, None for other models."""

    title: str
    folder: Path
    package: str = TRANSFORMERS
    file: Path | None = None

    @property
    def weights(self) -> tuple[Path, ...]:
        """The files of its weights, in order of their names."""
        if self.file is not None:
            return (self.file,)
        return tuple(path for path in weight_files(self.folder) if path.suffix == ".safetensors")

    @property
    def weight_bytes(self) -> int:
        """What they take on disk."""
        return sum(path.stat().st_size for path in self.weights)


def known_model(name: str) -> KnownModel:
    """Raises InputError, naming those there are."""
    for model in KNOWN_MODELS:
        if model.name == name:
            return model
    names = ", ".join(model.name for model in KNOWN_MODELS)
    raise InputError(f"{name}: no depth model of this name is known; there are {names}")


def model_to_use(choice: DepthChoice) -> LocalModel | None:
    """The model that the user wants (a folder, an ONNX file or a known name), else the usual one if it is ready, else
    None.

    Raises InputError where what is wanted is not here, or the package that runs it is not installed.
    """
    wanted = choice.model
    if wanted is None:
        usual = known_model(USUAL_MODEL)
        folder = cached_folder(usual) if lacking_package(usual.package) is None else None
        if folder is None and choice.asks_for_model:
            raise InputError(f"--depth model: none is on this machine; get one with: iibr models get {USUAL_MODEL}")
        return _local(usual.title, folder, usual.package) if folder is not None else None
    path = Path(os.path.expanduser(wanted))
    if is_folder(path):
        return _model_in(path)
    if is_file(path) and path.suffix == ".onnx":
        _require_installed(wanted, ONNX)
        # The hub lays the settings of ONNX models out in the folder above.
        folder = path.parent.parent if path.parent.name == "onnx" else path.parent
        return LocalModel(f"the model {path.name}", folder, ONNX, path)
    if is_file(path):
        raise InputError(
            f"{wanted}: is no ONNX file; --depth-model takes one, a model's folder, or a name `iibr models` lists"
        )
    if "/" in wanted or "\\" in wanted:
        raise InputError(f"{wanted}: no such folder")
    model = known_model(wanted)
    _require_installed(model.title, model.package)
    folder = cached_folder(model)
    if folder is None:
        raise InputError(f"{wanted} is not on this machine; get it with: iibr models get {wanted}")
    return _local(model.title, folder, model.package)


def _local(title: str, folder: Path, package: str) -> LocalModel:
    """Raises InputError where an ONNX model's folder leaves open which file is meant."""
    return LocalModel(title, folder, package, onnx_file(folder) if package == ONNX else None)


def lacking_package(package: str) -> str | None:
    """Which of the packages that a model runs on is not installed, its own or torch; None where none is missing."""
    packages = (package,) if package == ONNX else (package, "torch")
    return next((name for name in packages if not is_installed(name)), None)


def cached_folder(model: KnownModel) -> Path | None:
    """Where a model lies in the local Hugging Face cache, None where it does not, or without weights."""
    folder = verified_folder(model.repository, model.commit)
    return folder if folder is not None and any(weight_files(folder)) else None


def weight_files(folder: Path) -> Iterator[Path]:
    """The safetensors and ONNX files of a model folder, each kind in order of their names."""
    for pattern in ("*.safetensors", "*.onnx", "onnx/*.onnx"):
        yield from sorted(folder.glob(pattern))


def onnx_file(folder: Path) -> Path:
    """The one ONNX file of a model folder, `model.onnx` where there are several. Raises InputError for any other."""
    files = [path for path in weight_files(folder) if path.suffix == ".onnx"]
    full = [path for path in files if path.name == "model.onnx"]
    if len(files) != 1 and len(full) != 1:
        names = ", ".join(path.name for path in files[:3]) or "none"
        raise InputError(f"{folder}: which ONNX file is meant ({names})? Name it with --depth-model {folder}/FILE.onnx")
    return (full or files)[0]


def bytes_of(folder: Path) -> int:
    """What a model's weights take on disk."""
    return sum(path.stat().st_size for path in weight_files(folder))


def fetch(model: KnownModel, report_progress: ReportProgress | None = None, should_stop: ShouldStop = never) -> Path:
    """Download a model into the local Hugging Face cache. Returns its folder, named by the commit.

    Raises as `download` does, and InputError where its weights are neither ONNX nor safetensors.
    """
    folder = download(model.repository, model.commit, model.files, report_progress, should_stop)
    if not any(weight_files(folder)):
        raise InputError(f"{model.repository} publishes no ONNX or safetensors weights; pickled ones are not taken")
    return folder


def _model_in(folder: Path) -> LocalModel:
    """The model in a user's folder: ONNX where it holds such files alone, else what its config.json says."""
    from iibr_core.depth.models.config import package_for, read_config

    is_onnx = {path.suffix for path in weight_files(folder)} == {".onnx"}
    package = ONNX if is_onnx else package_for(read_config(folder))
    _require_installed(str(folder), package)
    return _local(f"the model in {folder.name or folder}", folder, package)


def _require_installed(what: str, package: str) -> None:
    lacking = lacking_package(package)
    if lacking is not None:
        install = INSTALLS.get(package, INSTALL_HINT)
        raise InputError(f"{what} needs the package {lacking}, which is not installed: {install}")
