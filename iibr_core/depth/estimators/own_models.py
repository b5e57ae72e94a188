"""ONNX files of the user's own, copied to one folder and found there by name."""

from __future__ import annotations

import filecmp
import shutil
from pathlib import Path

from platformdirs import user_data_path

from iibr_core.depth.estimators.config import CONFIG, PREPROCESSOR, folder_of
from iibr_core.depth.estimators.onnx_file import open_session, picture_input
from iibr_core.depth.estimators.onnx_models import weights_in
from iibr_core.formats.files import entries_of, is_file, is_folder
from iibr_core.formats.outputs import write_folder
from iibr_core.types import InputError

UNSPECIFIC_NAMES = ("model", "onnx")
"""Stems of files that are named after their folders, as those from the Hugging Face hub are."""


def own_models_folder() -> Path:
    """The folder with one folder for each copied model; it may not exist yet."""
    return user_data_path("iibr", appauthor=False) / "models"


def list_own_models() -> dict[str, Path]:
    """The ONNX files of the copied models, by name, in order. Raises InputError where they cannot be listed."""
    place = own_models_folder()
    folders = entries_of(place) if is_folder(place) else []
    files = {folder.name: folder / f"{folder.name}.onnx" for folder in folders}
    return {name: file for name, file in files.items() if is_file(file)}


def own_name(path: Path) -> str:
    """The name under which the ONNX file at `path`, or the one in that folder, is found once it is copied."""
    file = weights_in(path)[0].resolve()
    return folder_of(file).name if file.stem in UNSPECIFIC_NAMES else file.stem


def copy_own_model(path: Path) -> Path:
    """Copy an ONNX file, with its files of weights and settings, to where it is found by name; returns the copy.

    Nothing happens where the same file is there already. Raises InputError where it is no model that takes one picture,
    another model has its name, or it cannot be written.
    """
    file, *weights = weights_in(path)
    picture_input(open_session(file), file)
    name = own_name(path)
    copy = own_models_folder() / name / f"{name}.onnx"
    if copy.parent.exists():
        if is_file(copy) and filecmp.cmp(file, copy, shallow=False):
            return copy
        raise InputError(f"{copy.parent}: another model has this name; rename {file}, or delete that folder")
    settings = {folder_of(file) / settings: settings for settings in (CONFIG, PREPROCESSOR)}
    inner = {source: str(source.relative_to(file.parent)) for source in weights}
    _copy_into(copy.parent, {file: copy.name, **inner, **{path: to for path, to in settings.items() if is_file(path)}})
    return copy


def _copy_into(folder: Path, files: dict[Path, str]) -> None:
    """Make a folder of copies, each under its name in it, all or nothing. Raises InputError where that cannot be."""
    with write_folder(folder) as unfinished:
        for source, name in files.items():
            (unfinished / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, unfinished / name)
