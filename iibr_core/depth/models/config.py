"""What a model's folder says about it: which kind it is, and how a photo is prepared for it. Read, never executed."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from iibr_core.depth.models.preparation import Preparation
from iibr_core.formats.files import is_file, printable, read_text
from iibr_core.types import ImageSize, InputError

CONFIG, PREPROCESSOR = "config.json", "preprocessor_config.json"
MAX_CONFIG_BYTES = 2**20
MAX_SIDE = 4096
TRANSFORMERS_KINDS = ("depth_anything", "depth_pro", "dpt", "zoedepth")
# The defaults of the library's own preparation, where the file leaves a value out.
USUAL_SIZE = {"depth_anything": (518, 518), "depth_pro": (1536, 1536), "dpt": (384, 384), "zoedepth": (384, 512)}
USUAL_MULTIPLE = {"depth_anything": 14, "zoedepth": 32}
KEEPS_ASPECT = ("depth_anything", "zoedepth")


def read_config(folder: Path) -> dict[str, Any]:
    """A model folder's config.json. Raises InputError where it is missing, damaged, or names a model elsewhere, which
    would be fetched.
    """
    config = _json_object(folder, CONFIG)
    elsewhere = _backbone_elsewhere(config)
    if elsewhere:
        raise InputError(
            f"{folder / CONFIG}: needs another model, {printable(elsewhere)}, which is not fetched; get a folder that"
            " holds all of it"
        )
    return config


def package_for(config: dict[str, Any]) -> str:
    """The Python package that runs a model with this config. Raises InputError where none is known to."""
    kind = config.get("model_type")
    if kind in TRANSFORMERS_KINDS:
        return "transformers"
    text = json.dumps(config).lower()
    for sign, package in (
        ("unidepth", "unidepth"),
        ("da3", "depth_anything_3"),
        ("depth_anything_3", "depth_anything_3"),
    ):
        if sign in text:
            return package
    raise InputError(f"config.json: model type {kind!r} is not among {', '.join(TRANSFORMERS_KINDS)}")


def read_preparation(folder: Path, kind: str) -> Preparation:
    """From preprocessor_config.json. Raises InputError where it is missing, damaged or absurd."""
    told = _json_object(folder, PREPROCESSOR)
    try:
        size = _size(told.get("size", USUAL_SIZE[kind]))
        multiple = int(told.get("ensure_multiple_of", USUAL_MULTIPLE.get(kind, 1)))
        preparation = Preparation(
            size,
            bool(told.get("keep_aspect_ratio", kind in KEEPS_ASPECT)),
            max(multiple, 1),
            kind == "zoedepth" and bool(told.get("do_pad", True)),
            _channels(told.get("image_mean", (0.5, 0.5, 0.5))),
            _channels(told.get("image_std", (0.5, 0.5, 0.5))),
        )
    except (TypeError, ValueError, KeyError, OverflowError) as error:
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
        told = json.loads(read_text(path, MAX_CONFIG_BYTES))
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
