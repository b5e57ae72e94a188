"""Hostile cases of what is read: photos, maps, light fields and saved pictures that are not what they seem."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

from tests.hostile.case import Case
from tests.hostile.sandbox import BAD_MAPS, BAD_PICTURES, BAD_VIEW_FILES

LONG_NAME = "n" * 300 + ".png"
NOT_UTF8 = os.fsdecode(b"\xff\xfe photo.png")

COMMANDS: dict[str, tuple[str, ...]] = {
    "plan": (),
    "view": (),
    "screenshot": ("-o", "new.png"),
    "generate": ("--grid", "3", "--out", "new"),
}
"""What opens a photo, with what else it needs."""


def _opening(command: str, path: str, *more: str) -> tuple[str, ...]:
    return (command, path, *COMMANDS[command], *more)


def _make_fifo(folder: Path) -> None:
    os.mkfifo(folder / "fifo.png")


def _make_socket(folder: Path) -> None:
    # By a relative name: the folder's own may be too long for a socket's.
    with socket.socket(socket.AF_UNIX) as place:
        descriptor = os.open(folder, os.O_RDONLY)
        place.bind(f"/proc/self/fd/{descriptor}/socket.png")
        os.close(descriptor)


def _lock(name: str, mode: int = 0) -> Callable[[Path], None]:
    def prepare(folder: Path) -> None:
        (folder / name).chmod(mode)

    return prepare


def _put_photo_into_folder(folder: Path) -> None:
    (folder / "folder" / "photo.png").write_bytes((folder / "photo.png").read_bytes())
    (folder / "folder").chmod(0)


# `view` needs a display for whatever it may open: there these are refused only where the path says enough.
_SEEN_BY_VIEW = {"missing.png", "loop.png", "dangling.png"}

_photos = [
    Case(f"{command} {name}", _opening(command, name), says=name)
    for command in COMMANDS
    for name in BAD_PICTURES
    if (command != "view" or name in _SEEN_BY_VIEW) and (command != "screenshot" or name != "folder")
]

_odd_paths = [
    Case(f"{command} {words}", _opening(command, path), prepare=prepare)
    for command in COMMANDS
    for words, path, prepare in (
        ("a long name", LONG_NAME, _lock("photo.jpg", 0o600)),
        ("a long path", "/".join(["folder"] * 1000), _lock("photo.jpg", 0o600)),
        ("no name", "", _lock("photo.jpg", 0o600)),
        ("a name that is not UTF-8", NOT_UTF8, _lock("photo.jpg", 0o600)),
        ("a name of two lines", "two\nlines.png", _lock("photo.jpg", 0o600)),
        ("a name of control characters", "\x1b[31mred\x07.png", _lock("photo.jpg", 0o600)),
        ("a fifo", "fifo.png", _make_fifo),
        ("a socket", "socket.png", _make_socket),
        ("a file as a folder", "photo.png/photo.png", _lock("photo.jpg", 0o600)),
    )
] + [
    Case(f"{command} {path}", _opening(command, path))
    for command in COMMANDS
    for path in ("/dev/null", "/dev/zero", "/proc/self/mem", "/")
    if command != "view" or path == "/dev/never"
]

_permissions = [
    case
    for command in COMMANDS
    for case in (
        Case(
            f"{command} a photo in a folder without search permission",
            _opening(command, "folder/photo.png"),
            prepare=_put_photo_into_folder,
            is_bound=True,
        ),
        Case(
            f"{command} a map in a folder without search permission",
            _opening(command, "photo.png", "--disparity", "folder/map.pfm"),
            prepare=_lock("folder"),
            is_bound=True,
        ),
        Case(
            f"{command} a map that may not be read",
            _opening(command, "photo.png", "--disparity", "map.pfm"),
            prepare=_lock("map.pfm"),
            is_bound=True,
        ),
    )
    if command != "view" or "search" in case.name
] + [
    Case(
        f"{command} a photo that may not be read",
        _opening(command, "photo.png"),
        prepare=_lock("photo.png"),
        is_bound=True,
        says="photo.png",
    )
    for command in COMMANDS
    if command != "view"
]

_maps = [
    Case(f"{command} --disparity {name}", _opening(command, "photo.png", "--disparity", name), says=name)
    for command in ("plan", "screenshot", "generate")
    for name in BAD_MAPS
]

_view_files = [
    *(Case(f"depth {name}", ("depth", name, "-o", "new.pfm"), says=name) for name in BAD_VIEW_FILES),
    *(
        Case(f"{command} {name}", _opening(command, name), says=name)
        for command in ("plan", "generate", "screenshot")
        for name in ("none_qs0x6a1.png", "odd_eslf.png", "raw.lfp")
    ),
]

_fields = [
    Case("screenshot a folder without views", _opening("screenshot", "folder"), says="folder"),
    Case("screenshot a locked light field", _opening("screenshot", "field"), prepare=_lock("field"), is_bound=True),
    Case("plan a light field", _opening("plan", "field"), says="field"),
    Case("generate from a light field", _opening("generate", "field"), says="field"),
    *(
        Case(f"evaluate {words}", ("evaluate", path, "--out", "new"))
        for words, path in (
            ("nothing", "missing"),
            ("a photo", "photo.png"),
            ("a folder without views", "folder"),
            ("a long name", LONG_NAME),
            ("a loop", "loop.png"),
            ("a name that is not UTF-8", NOT_UTF8),
            ("devices", "/dev"),
        )
    ),
    Case("evaluate a locked light field", ("evaluate", "field", "--out", "new"), prepare=_lock("field"), is_bound=True),
]

_saved = [
    Case(f"screenshot --like {name}", _opening("screenshot", "photo.png", "--like", name), says=name)
    for name in ("photo.png", "photo.jpg", "missing.png", "folder", "text.png", "cut.png", "bomb.png", "saved-huge.png")
] + [
    Case("screenshot --like a long name", _opening("screenshot", "photo.png", "--like", LONG_NAME)),
    Case(
        "screenshot --like a locked picture",
        _opening("screenshot", "photo.png", "--like", "saved.png"),
        prepare=_lock("saved.png"),
        is_bound=True,
    ),
]

_naming_files = [
    *(
        Case(f"screenshot --like {name}", _opening("screenshot", "photo.png", "--like", name), 0, makes=("new.png",))
        for name in ("saved-link.png", "saved-device.png", "saved-host.png")
    ),
    Case(
        "screenshot --like saved-busy.png",
        _opening("screenshot", "photo.png", "--like", "saved-busy.png"),
        says="11,000 strokes",
    ),
    Case(
        "generate --poses outside.json",
        ("generate", "photo.png", "--poses", "outside.json", "--out", "new"),
        says="outside.json",
    ),
    *(
        Case(f"generate --gloss {name}", _opening("generate", "photo.png", "--gloss", name), says=name)
        for name in ("gone.toml", "device.toml")
    ),
    Case(
        "generate --gloss marked.toml", _opening("generate", "photo.png", "--gloss", "marked.toml"), 0, makes=("new",)
    ),
]


def _make_pipe(name: str) -> Callable[[Path], None]:
    return lambda folder: os.mkfifo(folder / name)


_pipes = [
    Case(f"{words[0]} with a pipe for {words[-1]}", words, prepare=_make_pipe(name), says=f"{name}: is a pipe")
    for name, words in (
        ("in.toml", ("screenshot", "photo.png", "-o", "new.png", "--gloss", "in.toml")),
        ("in.json", ("generate", "photo.png", "--out", "new", "--poses", "in.json")),
        ("in.txt", ("export", "photo.png", "--to", "gif", "-o", "new.gif", "--path", "in.txt")),
        ("in.pfm", ("plan", "photo.png", "--disparity", "in.pfm")),
        ("in.png", ("screenshot", "photo.png", "-o", "new.png", "--like", "in.png")),
        ("in.lif", ("depth", "-o", "new.pfm", "in.lif")),
    )
]

INPUT_CASES = (
    *_pipes,
    *_view_files,
    *_photos,
    *_odd_paths,
    *_permissions,
    *_maps,
    *_fields,
    *_saved,
    *_naming_files,
)
