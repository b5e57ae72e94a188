"""Pictures to and from the system's clipboard. GLFW's holds text only, so the system's own programs carry them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from urllib.parse import unquote, urlsplit

from PIL import Image, ImageGrab, UnidentifiedImageError
from platformdirs import user_cache_path

from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError
from viewer.model.state.saving import PASTED_FOLDER

MOST_KEPT = 20
"""Pasted pictures; older ones go."""
PATIENCE_S = 20.0
"""For the program that carries a picture: on X11 it asks another window, which may hang."""
_MAC_COPY = "set the clipboard to (read (POSIX file (item 1 of argv)) as «class PNGf»)"
LACKING = "Pictures cannot be copied and pasted here: install xclip, or wl-clipboard under Wayland."
NOTHING = "There is neither a picture in the clipboard nor the path of one: copy one, and paste again."


@dataclass(frozen=True)
class Pasted:
    """What came out of the clipboard, as a file."""

    path: str


def copied_path() -> Path:
    """Where a picture lies that is about to be copied."""
    return _cache_folder() / "copied.png"


def copy_picture(path: Path) -> None:
    """Put the picture of this PNG file into the clipboard. Raises InputError, which says what is lacking."""
    command = _copying_command(path)
    try:
        with path.open("rb") as picture:
            # The program stays behind to hand the picture out: it must hold no pipe of ours.
            quiet = subprocess.DEVNULL
            subprocess.run(command, stdin=picture, stdout=quiet, stderr=quiet, check=True, timeout=PATIENCE_S)
    except (OSError, subprocess.SubprocessError) as error:
        raise InputError(f"The picture cannot be copied: {command[0]} failed ({error})") from error


def paste_picture(text: str) -> Pasted:
    """What the clipboard holds: a path, where its text is one, else a picture, written into the user's cache folder.

    text: of the clipboard, "" without. Raises InputError where there is nothing to open, or a program is lacking.
    """
    path = _path_in(text)
    return Pasted(path) if path is not None else _paste_pixels(_cache_folder() / PASTED_FOLDER)


def _paste_pixels(folder: Path) -> Pasted:
    try:
        held = ImageGrab.grabclipboard()
    except NotImplementedError as error:
        raise InputError(LACKING) from error
    except UnidentifiedImageError as error:  # xclip hands out text, too, where a picture is asked for
        raise InputError(NOTHING) from error
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(
            f"The picture in the clipboard cannot be read ({' '.join(str(error).split())[:120]})"
        ) from error
    if isinstance(held, list) and held:
        return Pasted(held[0])
    if not isinstance(held, Image.Image):
        raise InputError(NOTHING)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"pasted-{datetime.now():%Y-%m-%d-%H%M%S-%f}.png"
        with write_file(path) as temporary:
            held.save(temporary, "PNG")
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: the pasted picture cannot be kept there ({error})") from error
    for old in sorted(folder.glob("pasted-*.png"))[:-MOST_KEPT]:
        old.unlink(missing_ok=True)
    return Pasted(str(path))


def _path_in(text: str) -> str | None:
    """The file or folder that a text names, as file managers and terminals copy them."""
    line = text.strip().partition("\n")[0].strip().strip("'\"")
    if line.startswith("file://"):
        line = unquote(urlsplit(line).path)
    path = os.path.expanduser(line)
    return path if os.path.isabs(path) and os.path.exists(path.rstrip("\0")) else None


def _copying_command(path: Path) -> Sequence[str]:
    """What puts a PNG file, given as its input too, into the clipboard. Raises InputError where there is nothing."""
    if sys.platform == "darwin":
        return ["osascript", "-e", "on run argv", "-e", _MAC_COPY, "-e", "end run", str(path)]
    if os.environ.get("WAYLAND_DISPLAY") and shutil.which("wl-copy"):
        return ["wl-copy", "--type", "image/png"]
    if sys.platform != "win32" and os.environ.get("DISPLAY") and shutil.which("xclip"):
        return ["xclip", "-selection", "clipboard", "-t", "image/png", "-i"]
    raise InputError(
        "Pictures cannot be copied on this system; save it instead." if sys.platform == "win32" else LACKING
    )


def _cache_folder() -> Path:
    return user_cache_path("iibr", appauthor=False) / "clipboard"
