"""What a model's folder says about it: which kind it is, and how a photo is prepared for it. Read, never executed."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from iibr_core.depth.estimators.preparation import Preparation
from iibr_core.formats.files import is_file, is_folder, printable, read_text
from iibr_core.types import ImageSize, InputError

CONFIG, PREPROCESSOR = "config.json", "preprocessor_config.json"
MAX_SIDE = 4096
PICKLED = ("*.bin", "*.pt", "*.pth", "*.ckpt")


def folder_of(path: Path) -> Path:
    """The folder with the settings of a model that is a folder or a file: the hub lays files out in one below."""
    if is_folder(path):
        return path
    return path.parent.parent if path.parent.name == "onnx" else path.parent


def safetensors_in(folder: Path) -> tuple[Path, ...]:
    """The weights of a model's folder, in order of their names. Raises InputError where there are none, or pickles."""
    weights = tuple(sorted(folder.glob("*.safetensors")))
    pickled = [path.name for pattern in PICKLED for path in folder.glob(pattern)]
    if not weights and pickled:
        raise InputError(f"{folder}: {pickled[0]} is pickled, which can run code; only .safetensors weights are read")
    if not weights:
        raise InputError(f"{folder}: holds no .safetensors or .onnx weights; get the whole model folder")
    return weights


def mentions(folder: Path, *signs: str) -> bool:
    """Whether a folder's config.json holds one of these words, in lower case. Raises as `read_config` does."""
    text = json.dumps(read_config(folder)).lower()
    return any(sign in text for sign in signs)


def read_config(folder: Path) -> dict[str, Any]:
    """A model folder's config.json. Raises InputError where it is missing, damaged, or names a model elsewhere, which
    would be fetched.
    """
    config = _json_object(folder, CONFIG)
    elsewhere = _backbone_elsewhere(config)
    if elsewhere:
        raise InputError(
            f"{folder / CONFIG}: needs another model, {printable(elsewhere)}, which is not downloaded; get a"
            " folder that holds all of it"
        )
    return config


def read_preparation(folder: Path, usual: Preparation) -> Preparation:
    """From preprocessor_config.json; usual: what holds for values that it leaves out.

    Raises InputError where it is missing, damaged or absurd.
    """
    told = _json_object(folder, PREPROCESSOR)
    if told.get("do_normalize") is False:
        told = {**told, "image_mean": 0, "image_std": 1}
    try:
        size = _size(told.get("size", usual.size))
        multiple = int(told.get("ensure_multiple_of", usual.multiple))
        white = 255 * float(told.get("rescale_factor", 1 / 255)) if told.get("do_rescale", True) else 255.0
        preparation = Preparation(
            size,
            bool(told.get("keep_aspect_ratio", usual.keeps_aspect)),
            max(multiple, 1),
            usual.pads and bool(told.get("do_pad", True)),
            tuple(value / white for value in _channels(told.get("image_mean", usual.mean))),
            tuple(value / white for value in _channels(told.get("image_std", usual.std))),
        )
    except (TypeError, ValueError, KeyError, ArithmeticError) as error:
        raise InputError(f"{folder / PREPROCESSOR}: makes no sense ({' '.join(str(error).split())[:80]})") from error
    is_possible = all(1 <= side <= MAX_SIDE for side in size) and multiple <= MAX_SIDE
    if not is_possible or 0 in preparation.std or not all(map(math.isfinite, preparation.mean + preparation.std)):
        raise InputError(
            f"{folder / PREPROCESSOR}: size {size}, multiple {multiple}, std {preparation.std} make no sense"
        )
    return preparation


def _backbone_elsewhere(config: dict[str, Any]) -> str:
    """The name of a backbone that is not described in the config itself, "" without."""
    inner = config.get("backbone_config")
    if isinstance(inner, dict):
        return _backbone_elsewhere(inner)
    name = config.get("backbone")
    return name if isinstance(name, str) else ""


def _json_object(folder: Path, name: str) -> dict[str, Any]:
    path = folder / name
    if not is_file(path):
        raise InputError(f"{folder}: holds no {name}; get the whole model folder")
    try:
        told = json.loads(read_text(path))
        if not isinstance(told, dict):
            raise ValueError("no object")
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: damaged ({' '.join(str(error).split())[:80]})") from error
    return told


def _size(told: Any) -> ImageSize:
    if isinstance(told, int):
        return ImageSize(told, told)
    if isinstance(told, dict):
        return ImageSize(int(told["height"]), int(told["width"]))
    height, width = told
    return ImageSize(int(height), int(width))


def _channels(told: Any) -> tuple[float, ...]:
    values = (float(told),) * 3 if isinstance(told, int | float) else tuple(float(value) for value in told)
    if len(values) != 3:
        raise ValueError(f"{len(values)} channels")
    return values
