"""Depth models by name: what there is to be had, what lies on this machine, and how to fetch one. Loads no model.

Only safetensors files are ever fetched or read: pickled weights run code.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.files import is_file, is_folder, reason_of
from iibr_core.formats.outputs import atomic_write
from iibr_core.runtime.extras import is_installed
from iibr_core.runtime.tiling import Cancelled, ShouldStop, never
from iibr_core.types import InputError, ReportProgress

TRANSFORMERS = "transformers"
INSTALL_HINT = "pip install 'iibr[depth]'"


@dataclass(frozen=True)
class KnownModel:
    """A published model. repository: on the Hugging Face hub. megabytes: of its weights, about. package: that runs it,
    as Python imports it; install: how to get that. revision: the full commit that is downloaded; without one, the
    newest, which is written down (LOCK).
    """

    name: str
    title: str
    repository: str
    megabytes: int
    licence: str
    package: str = TRANSFORMERS
    install: str = INSTALL_HINT
    revision: str | None = None


LOCK = "iibr-lock.json"
"""Beside a downloaded model: its commit, and the SHA-256 of each of its files."""

USUAL_MODEL = "depth-anything-v2-small"

DA3_INSTALL = "pip install depth-anything-3"
UNIDEPTH_INSTALL = "follow github.com/lpiccinelli-eth/UniDepth"
MOGE_INSTALL = "follow github.com/microsoft/MoGe"
KNOWN_MODELS = (
    KnownModel(
        "depth-anything-v2-small",
        "Depth Anything V2 Small",
        "depth-anything/Depth-Anything-V2-Small-hf",
        99,
        "Apache-2.0",
    ),
    KnownModel(
        "depth-anything-v2-base",
        "Depth Anything V2 Base",
        "depth-anything/Depth-Anything-V2-Base-hf",
        390,
        "CC-BY-NC-4.0 (not for commercial use)",
    ),
    KnownModel(
        "depth-anything-v2-large",
        "Depth Anything V2 Large",
        "depth-anything/Depth-Anything-V2-Large-hf",
        1341,
        "CC-BY-NC-4.0 (not for commercial use)",
    ),
    KnownModel(
        "depth-anything-v2-metric-indoor",
        "Depth Anything V2 Metric Indoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Indoor-Small-hf",
        99,
        "Apache-2.0",
    ),
    KnownModel(
        "depth-anything-v2-metric-outdoor",
        "Depth Anything V2 Metric Outdoor Small",
        "depth-anything/Depth-Anything-V2-Metric-Outdoor-Small-hf",
        99,
        "Apache-2.0",
    ),
    KnownModel("depth-pro", "Depth Pro", "apple/DepthPro-hf", 1904, "Apple's model licence (for research)"),
    KnownModel("zoedepth", "ZoeDepth", "Intel/zoedepth-nyu-kitti", 1380, "MIT"),
    KnownModel("midas-dpt-hybrid", "MiDaS 3 (DPT hybrid)", "Intel/dpt-hybrid-midas", 490, "Apache-2.0"),
    KnownModel("midas-dpt-large", "MiDaS 3 (DPT large)", "Intel/dpt-large", 1370, "Apache-2.0"),
    KnownModel(
        "depth-anything-3-small",
        "Depth Anything 3 Small",
        "depth-anything/DA3-SMALL",
        138,
        "Apache-2.0",
        "depth_anything_3",
        DA3_INSTALL,
    ),
    KnownModel(
        "unidepth-v2-small",
        "UniDepth V2 Small",
        "lpiccinelli/unidepth-v2-vits14",
        137,
        "CC-BY-NC-4.0 (not for commercial use)",
        "unidepth",
        UNIDEPTH_INSTALL,
    ),
    KnownModel("moge-2", "MoGe 2", "Ruicheng/moge-2-vits-normal", 141, "MIT", "moge", MOGE_INSTALL),
)
"""Sizes and licences as published; the repository itself has the last word."""


@dataclass(frozen=True)
class LocalModel:
    """A model on this machine. package: the Python package that runs it."""

    title: str
    folder: Path
    package: str = TRANSFORMERS


def known_model(name: str) -> KnownModel:
    """Raises InputError, naming those there are."""
    for model in KNOWN_MODELS:
        if model.name == name:
            return model
    names = ", ".join(model.name for model in KNOWN_MODELS)
    raise InputError(f"{name}: no depth model of this name is known; there are {names}")


def model_to_use(choice: DepthChoice) -> LocalModel | None:
    """The model that the user wants (a folder or a known name), else the usual one if it is ready, else None.

    Raises InputError where what is wanted is not here, or the package that runs it is not installed.
    """
    wanted = choice.model
    if wanted is None:
        usual = known_model(USUAL_MODEL)
        folder = cached_folder(usual) if lacking_package(usual.package) is None else None
        if folder is None and choice.asks_for_model:
            raise InputError(f"--depth model: none is on this machine; get one with: iibr models get {USUAL_MODEL}")
        return LocalModel(usual.title, folder, usual.package) if folder is not None else None
    path = Path(os.path.expanduser(wanted))
    if is_folder(path):
        return _model_in(path)
    if is_file(path):
        raise InputError(f"{wanted}: is a file; --depth-model takes the model's folder, or a name `iibr models` lists")
    if "/" in wanted or "\\" in wanted:
        raise InputError(f"{wanted}: no such folder")
    model = known_model(wanted)
    _require_installed(model.title, model.package, model.install)
    folder = cached_folder(model)
    if folder is None:
        raise InputError(f"{wanted} is not on this machine; get it with: iibr models get {wanted}")
    return LocalModel(model.title, folder, model.package)


def lacking_package(package: str) -> str | None:
    """Which of the packages that a model runs on is not installed, its own or torch; None where both are."""
    return next((name for name in (package, "torch") if not is_installed(name)), None)


def cached_folder(model: KnownModel) -> Path | None:
    """Where a model lies in the local Hugging Face cache, None where it does not, or without weights."""
    if not is_installed("huggingface_hub"):
        return None
    from huggingface_hub import constants

    # Looked for by hand first: importing the rest of the library takes half a second.
    repository = Path(constants.HF_HUB_CACHE) / f"models--{model.repository.replace('/', '--')}"
    if not os.path.isdir(repository):  # nor where it may not be looked at
        return None
    from huggingface_hub import try_to_load_from_cache

    locks = sorted(repository.glob(f"snapshots/*/{LOCK}"), key=lambda lock: lock.stat().st_mtime_ns)
    revision = model.revision or (locks[-1].parent.name if locks else None)
    found = try_to_load_from_cache(model.repository, "config.json", revision=revision)
    folder = Path(found).parent if isinstance(found, str) else None
    return folder if folder is not None and any(weight_files(folder)) else None


def weight_files(folder: Path) -> Iterator[Path]:
    """The safetensors files of a model folder, in order of their names."""
    yield from sorted(folder.glob("*.safetensors"))


def bytes_of(folder: Path) -> int:
    """What a model's weights take on disk."""
    return sum(path.stat().st_size for path in weight_files(folder))


def fetch(model: KnownModel, report_progress: ReportProgress | None = None, should_stop: ShouldStop = never) -> Path:
    """Download a model into the local Hugging Face cache: one commit, written down with what came. Returns its folder,
    named by the commit.

    report_progress: told bytes that are here and bytes in all; None shows bars on stderr. Raises InputError where it
    fails: no network, no right to it, no safetensors; Cancelled once should_stop is true: the next one goes on there.
    """
    if not is_installed("huggingface_hub"):
        raise InputError(f"downloading needs the package huggingface_hub: {INSTALL_HINT}")
    from huggingface_hub import model_info, snapshot_download
    from huggingface_hub.errors import GatedRepoError

    try:
        commit = model.revision or model_info(model.repository).sha
        if not _is_commit(commit):
            raise ValueError(f"{commit} is no commit")
        patterns = ["*.json", "*.safetensors"]
        bars = None if report_progress is None else _counting_bars(report_progress, should_stop)
        folder = Path(snapshot_download(model.repository, revision=commit, allow_patterns=patterns, tqdm_class=bars))
    except Cancelled:
        raise
    except GatedRepoError as error:
        raise InputError(
            f"{model.repository}: its owner asks you to accept a licence on huggingface.co first"
        ) from error
    except Exception as error:  # whatever the library's ways to the network raise: they change with its versions
        reason = str(error).strip().partition("\n")[0].removeprefix("Got: ")[:120] or type(error).__name__
        raise InputError(
            f"{model.name} cannot be downloaded ({reason}); check the network, or copy the folder of "
            f"{model.repository} here and name it with --depth-model"
        ) from error
    if not any(weight_files(folder)):
        raise InputError(f"{model.repository} publishes no safetensors weights; pickled ones are not taken")
    _write_lock(folder)
    return folder


def _counting_bars(report_progress: ReportProgress, should_stop: ShouldStop) -> type[Any]:
    """Progress bars for the hub library that show nothing: they count, and stop the download."""
    from tqdm import tqdm  # type: ignore[import-untyped]

    class CountingBar(tqdm):  # type: ignore[misc]
        def __init__(self, *args: Any, **options: Any) -> None:
            self._counts_bytes = options.get("unit") == "B"
            super().__init__(*args, **{**options, "disable": True})

        def update(self, n: float | None = 1) -> None:
            if should_stop():
                raise Cancelled
            self.n += n or 0
            if self._counts_bytes:
                report_progress(self.n, self.total or 0, "downloading")

    return CountingBar


def require_unchanged(folder: Path) -> None:
    """Raise InputError where a file of a downloaded model is not what came. Models from elsewhere have no lock."""
    if not (folder / LOCK).is_file():
        return
    try:
        locked = json.loads((folder / LOCK).read_text("utf-8"))["sha256"]
        changed = sorted(locked.items() ^ _digests(folder).items())
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"{folder / LOCK}: damaged ({reason_of(error)}); delete {folder} and get it again") from error
    if changed:
        raise InputError(f"{folder}: {changed[0][0]} changed since it was downloaded; delete {folder} and get it again")


def _is_commit(text: str | None) -> bool:
    return re.fullmatch("[0-9a-f]{40}", text or "") is not None


def _write_lock(folder: Path) -> None:
    lock = {"commit": folder.name, "sha256": _digests(folder)}
    with atomic_write(folder / LOCK) as temporary:
        temporary.write_text(json.dumps(lock, indent=1) + "\n", "utf-8")


def _digests(folder: Path) -> dict[str, str]:
    """SHA-256 by name of all that is read of a model: weights and JSON, in folders of its own too."""
    digests = {}
    for path in (path for ending in ("json", "safetensors") for path in folder.rglob(f"*.{ending}")):
        if path.name != LOCK:
            with path.open("rb") as file:
                digests[path.relative_to(folder).as_posix()] = hashlib.file_digest(file, "sha256").hexdigest()
    return digests


def _model_in(folder: Path) -> LocalModel:
    """The model in a user's folder. Which package runs it stands in its config.json."""
    from iibr_core.depth.models.config import package_for, read_config

    package = package_for(read_config(folder))
    install = next((model.install for model in KNOWN_MODELS if model.package == package), INSTALL_HINT)
    _require_installed(str(folder), package, install)
    return LocalModel(f"the model in {folder.name or folder}", folder, package)


def _require_installed(what: str, package: str, install: str) -> None:
    lacking = lacking_package(package)
    if lacking is not None:
        raise InputError(f"{what} needs the package {lacking}, which is not installed: {install}")
