"""The system's own file dialogs, one at a time; asked without blocking the window."""

from __future__ import annotations

import shutil
import sys
from typing import Any

from viewer.model.state.app_state import ChoiceOf

UNIX_HELPERS = ("zenity", "kdialog", "matedialog", "qarma")
"""Programs that show the dialog on Unix; the bundle calls the first it finds."""

PHOTO_SUFFIXES = "*.jpg *.jpeg *.png *.tif *.tiff *.exr *.hdr *.webp *.bmp *.heic"
FILE_KINDS: dict[ChoiceOf, str] = {
    "photo": PHOTO_SUFFIXES,
    "mask": "*.png *.jpg *.jpeg *.tif *.tiff *.bmp *.exr",
    "map": "*.pfm *.exr *.npy *.png *.tif *.tiff",
}
"""What is no folder."""

DIALOG_TITLES: dict[ChoiceOf, str] = {
    "photo": "Open a photo",
    "folder": "Open a folder of views",
    "mask": "Aperture image",
    "truth": "Ground truth: a folder of views",
    "map": "Open a disparity map for this photo",
    "model": "Open the folder of a depth model",
}


def has_dialogs() -> bool:
    """Whether this system has file dialogs."""
    return sys.platform in ("win32", "darwin") or any(map(shutil.which, UNIX_HELPERS))


class Dialog:
    """An open dialog. what: what it asks for."""

    def __init__(self, what: ChoiceOf) -> None:
        from imgui_bundle import portable_file_dialogs as dialogs

        self.what = what
        self._dialog: Any
        kinds = FILE_KINDS.get(what)
        if kinds is None:
            self._dialog = dialogs.select_folder(DIALOG_TITLES[what])
        else:
            self._dialog = dialogs.open_file(DIALOG_TITLES[what], filters=["Images", kinds, "All files", "*"])

    def answer(self) -> str | None:
        """The path chosen, "" where the user chose none; None while it is open."""
        if not self._dialog.ready(0):
            return None
        result = self._dialog.result()
        return result if isinstance(result, str) else (result[0] if result else "")
