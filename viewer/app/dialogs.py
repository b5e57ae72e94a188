"""The system's dialogs: for files, one at a time, which do not block the window, and for errors at the start."""

from __future__ import annotations

import os
import shutil
import sys
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from imgui_bundle import portable_file_dialogs as dialogs

from iibr_core.exports.kinds import export_kind
from iibr_core.exports.photo_folder import FolderPhoto, in_order, list_photos
from viewer.model.browsing import Listing
from viewer.model.saving import ExportPrompt, SavePrompt
from viewer.model.tasks import ChoiceOf

UNIX_HELPERS = ("zenity", "kdialog", "matedialog", "qarma")
"""Programs that show the dialog on Unix; the bundle calls the first that it finds."""
CHOICES: dict[ChoiceOf, tuple[str, str]] = {
    "photo": (
        "Open a photo, a stereo photo or a quilt",
        "jpg jpeg png tif tiff exr hdr webp bmp heic heif hif avif mpo lif",
    ),
    "folder": ("Open a folder of photos or views", ""),
    "mask": ("Open a picture as the shape of the aperture", "png jpg jpeg tif tiff bmp exr"),
    "map": ("Open a depth map for this photo", "pfm exr npy png tif tiff"),
    "model": ("Open a depth model (ONNX file)", "onnx"),
    "model folder": ("Open the folder of a depth model", ""),
}
"""Title of the dialog, and endings of the files that can be chosen; none for folders."""


@dataclass(frozen=True)
class Dialog:
    """An open dialog. asked: choice or prompt that it is for. name: of the folder to make in the chosen one."""

    asked: ChoiceOf | SavePrompt | ExportPrompt
    dialog: Any
    name: str = ""

    def answer(self) -> str | None:
        """Return the chosen path, "" if the user chose none, None while the dialog is open."""
        if not self.dialog.ready(0):
            return None
        result = self.dialog.result()
        chosen = result if isinstance(result, str) else "".join(result[:1])
        return os.path.join(chosen, self.name) if chosen and self.name else chosen

    def close(self) -> None:
        """Close the dialog; without this, the bundle's destructor waits for the user."""
        self.dialog.kill()


def has_dialogs() -> bool:
    """Return whether this system has file dialogs."""
    return sys.platform in ("win32", "darwin") or any(map(shutil.which, UNIX_HELPERS))


def show_error(message: str) -> None:
    """Show a message until the user closes it, where this system has dialogs."""
    if has_dialogs():
        dialogs.message("iibr", message, dialogs.choice.ok, dialogs.icon.error).result()


def ask_for_path(what: ChoiceOf, beside: str = "") -> Dialog:
    """Open the dialog for a file or folder, in the folder that holds `beside`, or is it if a separator ends it."""
    folder = os.path.abspath(os.path.dirname(os.path.expanduser(beside)))
    start = os.path.join(folder, "") if beside else ""
    title, endings = CHOICES[what][0], CHOICES[what][1].split()
    if not endings:
        return Dialog(what, dialogs.select_folder(title, start))
    patterns = " ".join(f"*.{ending}" for ending in (*endings, *map(str.upper, endings)))
    filters = ["Models" if what == "model" else "Images", patterns, "All files", "*"]
    return Dialog(what, dialogs.open_file(title, start, filters))


def list_folder(what: ChoiceOf, typed: str, path: str) -> Listing:
    """Return the folders and the files to choose in a folder, in order, without hidden ones; none if it cannot be read.

    typed: the folder as the user typed it. path: the same, absolute.
    """
    photos = list(list_photos(path)) if what in ("photo", "folder") else None
    folders: list[str] = []
    files: list[FolderPhoto] = []
    with suppress(OSError), os.scandir(path) as entries:
        for entry in entries:
            if entry.name.startswith("."):
                continue
            if entry.is_dir():
                folders.append(entry.name)
            elif photos is None and entry.name.lower().endswith(tuple(f".{end}" for end in CHOICES[what][1].split())):
                files.append(FolderPhoto(entry.name))
    shown = in_order(files if photos is None else photos, "name")
    return Listing(typed, path, tuple(sorted(folders, key=str.casefold)), tuple(each.name for each in shown))


def ask_for_place(prompt: SavePrompt | ExportPrompt) -> Dialog:
    """Open the dialog for the file or folder that a prompt writes."""
    path = os.path.abspath(os.path.expanduser(prompt.path))
    title = "Save the picture" if isinstance(prompt, SavePrompt) and prompt.what == "picture" else "Save the depth map"
    if isinstance(prompt, ExportPrompt):
        kind = export_kind(prompt.kind)
        title = f"Export: {kind.words}"
        if not kind.endings:
            return Dialog(prompt, dialogs.select_folder(title, os.path.dirname(path)), os.path.basename(path))
    return Dialog(prompt, dialogs.save_file(title, path, ["All files", "*"]))
