"""The system's own file dialogs, one at a time; asked without blocking the window."""

from __future__ import annotations

import os
import shutil
import sys
from typing import Any

from viewer.model.state.prompts import ChoiceOf, SavePrompt

UNIX_HELPERS = ("zenity", "kdialog", "matedialog", "qarma")
"""Programs that show the dialog on Unix; the bundle calls the first it finds."""

FILE_KINDS: dict[ChoiceOf, str] = {
    "photo": "jpg jpeg png tif tiff exr hdr webp bmp heic heif hif avif mpo lif",
    "mask": "png jpg jpeg tif tiff bmp exr",
    "surroundings": "exr hdr png jpg jpeg tif tiff",
    "map": "pfm exr npy png tif tiff",
    "model": "onnx",
}
"""Endings of what is no folder."""

DIALOG_TITLES: dict[ChoiceOf, str] = {
    "photo": "Open a photo, a stereo photo or a quilt",
    "folder": "Open a folder of views",
    "mask": "Aperture image",
    "surroundings": "Picture all around, equirectangular",
    "truth": "Ground truth: a folder of views",
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


class Dialog:
    """An open dialog. what: what it asks for."""

    def __init__(self, what: ChoiceOf, beside: str = "") -> None:
        """beside: the file or folder that is open; the dialog begins in the folder that holds it."""
        from imgui_bundle import portable_file_dialogs as dialogs

        self.what = what
        self._dialog: Any
        start = os.path.join(os.path.dirname(os.path.abspath(beside)), "") if beside else ""
        if what not in FILE_KINDS:
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


class SaveDialog:
    """An open dialog that asks where a file goes, and before one is replaced. prompt: what asked for it."""

    def __init__(self, prompt: SavePrompt) -> None:
        from imgui_bundle import portable_file_dialogs as dialogs

        self.prompt = prompt
        title = "Save the picture" if prompt.what == "picture" else "Save the depth map"
        self._dialog: Any = dialogs.save_file(title, os.path.abspath(prompt.path), ["All files", "*"])

    def answer(self) -> str | None:
        """The path chosen, "" where the user chose none; None while it is open."""
        return str(self._dialog.result()) if self._dialog.ready(0) else None
