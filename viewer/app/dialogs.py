"""The system's own file dialogs, one at a time; asked without blocking the window."""

from __future__ import annotations

import os
import shutil
import sys
from itertools import islice
from typing import Any

from iibr_core.exports.kinds import export_kind
from viewer.model.state.exporting import ExportPrompt
from viewer.model.state.prompts import FOLDER_CHOICES, ChoiceOf, FolderContents, SavePrompt

UNIX_HELPERS = ("zenity", "kdialog", "matedialog", "qarma")
"""Programs that show the dialog on Unix; the bundle calls the first it finds."""

FILE_KINDS: dict[ChoiceOf, str] = {
    "photo": "jpg jpeg png tif tiff exr hdr webp bmp heic heif hif avif mpo lif",
    "mask": "png jpg jpeg tif tiff bmp exr",
    "map": "pfm exr npy png tif tiff",
    "model": "onnx",
}
"""Endings of what is no folder."""
MOST_ENTRIES = 5000
"""Of a folder: a list of more helps nobody."""

DIALOG_TITLES: dict[ChoiceOf, str] = {
    "photo": "Open a photo, a stereo photo or a quilt",
    "folder": "Open a folder of photos or views",
    "mask": "Picture as the shape of the aperture",
    "map": "Open a disparity map for this photo",
    "model": "Open a depth model: an ONNX file",
    "model folder": "Open the folder of a depth model",
}


def has_dialogs() -> bool:
    """Whether this system has file dialogs."""
    return sys.platform in ("win32", "darwin") or any(map(shutil.which, UNIX_HELPERS))


def file_patterns(what: ChoiceOf) -> str:
    """For the dialog to choose from; cameras write endings in capitals, and dialogs tell them apart."""
    endings = FILE_KINDS[what].split()
    return " ".join(f"*.{ending}" for ending in (*endings, *map(str.upper, endings)))


class _OpenDialog:
    """A dialog of the system that is open."""

    _dialog: Any

    def close(self) -> None:
        """Close the dialog; without this, the bundle's destructor waits for the user."""
        self._dialog.kill()


class Dialog(_OpenDialog):
    """An open dialog. what: what it asks for."""

    def __init__(self, what: ChoiceOf, beside: str = "") -> None:
        """beside: the file or folder that is open; the dialog begins in the folder that holds it."""
        from imgui_bundle import portable_file_dialogs as dialogs

        self.what = what
        start = os.path.join(os.path.dirname(os.path.abspath(beside)), "") if beside else ""
        if what in FOLDER_CHOICES:
            self._dialog = dialogs.select_folder(DIALOG_TITLES[what], start)
        else:
            filters = ["Models" if what == "model" else "Images", file_patterns(what), "All files", "*"]
            self._dialog = dialogs.open_file(DIALOG_TITLES[what], start, filters)

    def answer(self) -> str | None:
        """The path chosen, "" where the user chose none; None while it is open."""
        if not self._dialog.ready(0):
            return None
        result = self._dialog.result()
        return result if isinstance(result, str) else (result[0] if result else "")


class SaveDialog(_OpenDialog):
    """An open dialog that asks where a file goes, and before one is replaced; or into which folder a folder goes.
    prompt: what asked for it.
    """

    def __init__(self, prompt: SavePrompt | ExportPrompt) -> None:
        from imgui_bundle import portable_file_dialogs as dialogs

        self.prompt, path = prompt, os.path.abspath(os.path.expanduser(prompt.path))
        self._name = os.path.basename(path) if _is_folder_export(prompt) else ""
        if self._name:
            self._dialog = dialogs.select_folder(_title_of(prompt), os.path.dirname(path))
        else:
            self._dialog = dialogs.save_file(_title_of(prompt), path, ["All files", "*"])

    def answer(self) -> str | None:
        """The path chosen, "" where the user chose none; None while it is open."""
        if not self._dialog.ready(0):
            return None
        chosen = str(self._dialog.result())
        return os.path.join(chosen, self._name) if chosen and self._name else chosen


def _is_folder_export(prompt: SavePrompt | ExportPrompt) -> bool:
    return isinstance(prompt, ExportPrompt) and not export_kind(prompt.kind).endings


def _title_of(prompt: SavePrompt | ExportPrompt) -> str:
    if isinstance(prompt, ExportPrompt):
        return f"Export: {export_kind(prompt.kind).words}"
    return "Save the picture" if prompt.what == "picture" else "Save the depth map"


def contents_of(folder: str, what: ChoiceOf) -> FolderContents:
    """What can be chosen in a folder, by name; nothing that is hidden, or that a panel cannot show."""
    endings = tuple(f".{ending}" for ending in FILE_KINDS.get(what, "").split())
    folders, files = [], []
    try:
        with os.scandir(os.path.expanduser(folder) or os.curdir) as entries:
            for entry in islice(entries, MOST_ENTRIES):
                if entry.name.startswith(".") or not _can_be_shown(entry.name):
                    continue
                if entry.is_dir():
                    folders.append(entry.name)
                elif what == "place" or entry.name.lower().endswith(endings or "\0"):
                    files.append(entry.name)
    except OSError as error:
        problem = f"This folder cannot be read: {error.strerror or error}."
    except ValueError:
        problem = "No folder can have this name."
    else:
        problem = ""
    return FolderContents(folder, _in_order(folders), _in_order(files), is_read=True, problem=problem)


def _can_be_shown(name: str) -> bool:
    return name.encode(errors="replace").decode() == name


def _in_order(names: list[str]) -> tuple[str, ...]:
    return tuple(sorted(names, key=lambda name: (name.lower(), name)))
