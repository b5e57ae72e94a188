"""Pictures to and from the system's clipboard. GLFW's holds text only, so the system's own programs carry them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from urllib.parse import unquote, urlsplit

from PIL import Image, ImageGrab
from platformdirs import user_cache_path

from iibr_core.formats.outputs import make_folder, write_file
from iibr_core.types import InputError
from viewer.model.demo_photo import PASTED_FOLDER

MAX_PASTED = 20
"""Number of pasted pictures that are kept."""
TIMEOUT_S = 20.0
"""Time for the program that carries a picture: on X11 it asks another window, which may hang."""
_MAC_COPY = "set the clipboard to (read (POSIX file (item 1 of argv)) as «class PNGf»)"
LACKING = "Pictures cannot be copied and pasted here. Install xclip, or wl-clipboard under Wayland."
NOTHING = "The clipboard holds neither a picture nor the path of one. Copy one and paste again."


def copied_path() -> Path:
    """Return the path of the file that holds a picture to be copied."""
    return user_cache_path("iibr", appauthor=False) / "clipboard" / "copied.png"


def copy_picture(path: Path) -> None:
    """Put the picture of a PNG file into the clipboard. Raises InputError."""
    command = _copying_command(path)
    try:
        with path.open("rb") as picture:
            # The program stays behind to hand the picture out: it must hold no pipe of ours.
            quiet = subprocess.DEVNULL
            subprocess.run(command, stdin=picture, stdout=quiet, stderr=quiet, check=True, timeout=TIMEOUT_S)
    except (OSError, subprocess.SubprocessError) as error:
        raise InputError(f"The picture cannot be copied: {command[0]} failed ({error})") from error


def paste_picture(text: str) -> str:
    """Return the path in the clipboard's text, else that of a new file with the clipboard's picture.

    Raises InputError if there is neither.
    """
    if found := _path_in(text):
        return found
    folder = copied_path().with_name(PASTED_FOLDER)
    try:
        held = ImageGrab.grabclipboard()
    except NotImplementedError as error:
        raise InputError(LACKING) from error
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError(f"{NOTHING} ({' '.join(str(error).split())[:120]})") from error
    if isinstance(held, list) and held:
        return held[0]
    if not isinstance(held, Image.Image):
        raise InputError(NOTHING)
    make_folder(folder)
    path = folder / f"pasted-{datetime.now():%Y-%m-%d-%H%M%S-%f}.png"
    with write_file(path) as temporary:
        held.save(temporary, "PNG")
    for old in sorted(folder.glob("pasted-*.png"))[:-MAX_PASTED]:
        old.unlink(missing_ok=True)
    return str(path)


def _path_in(text: str) -> str | None:
    """Return the existing file or folder that a text names, as file managers and terminals copy them."""
    line = text.strip().partition("\n")[0].strip().strip("'\"")
    if line.startswith("file://"):
        line = unquote(urlsplit(line).path)
    path = os.path.expanduser(line)
    return path if os.path.isabs(path) and os.path.exists(path.rstrip("\0")) else None


def _copying_command(path: Path) -> Sequence[str]:
    """Return the command that puts a PNG file, also given as its input, into the clipboard. Raises InputError."""
    if sys.platform == "darwin":
        return ["osascript", "-e", "on run argv", "-e", _MAC_COPY, "-e", "end run", str(path)]
    if os.environ.get("WAYLAND_DISPLAY") and shutil.which("wl-copy"):
        return ["wl-copy", "--type", "image/png"]
    if sys.platform != "win32" and os.environ.get("DISPLAY") and shutil.which("xclip"):
        return ["xclip", "-selection", "clipboard", "-t", "image/png", "-i"]
    raise InputError("Pictures cannot be copied on Windows. Save it instead." if sys.platform == "win32" else LACKING)
