"""Hostile cases of `iibr batch`: options, what lies in the folder of exports, and limits under which workers start."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from tests.hostile.case import Case

ALBUM = "album"
OWN_PROCESS = {"IIBR_THREADS": "1"}
"""A fork of the tests' may start no workers."""
EXPORTING = ("batch", ALBUM, "--to", "depth", "-o", "new", "--workers", "1")
TLS = ("--tls-ca", "text.txt", "--tls-cert", "text.txt", "--tls-key", "text.txt")
ELSEWHERE = ("batch", ALBUM, "--to", "depth", "-o", "new", "--scheduler")


def _make_album(folder: Path) -> None:
    """Two photos, one of which has a map."""
    (folder / ALBUM).mkdir()
    for name in ("photo.png", "other.png"):
        (folder / ALBUM / name).write_bytes((folder / "photo.png").read_bytes())
    (folder / ALBUM / "photo_disparity.pfm").write_bytes((folder / "map.pfm").read_bytes())


def _with_exports(*make: Callable[[Path], None]) -> Callable[[Path], None]:
    def prepare(folder: Path) -> None:
        _make_album(folder)
        (folder / "new").mkdir()
        (folder / "new/manifest.jsonl").touch()
        for each in make:
            each(folder)

    return prepare


def _linked(name: str, to: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        (folder / "new" / name).unlink(missing_ok=True)
        (folder / "new" / name).symlink_to(folder / to)

    return make


def _linked_hard(name: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        (folder / "new" / name).unlink(missing_ok=True)
        (folder / "new" / name).hardlink_to(folder / ALBUM / "photo.png")

    return make


def _pipe(name: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        (folder / "new" / name).unlink(missing_ok=True)
        os.mkfifo(folder / "new" / name)

    return make


def _written(name: str, content: bytes) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        (folder / "new" / name).write_bytes(content)

    return make


OTHER_KIND = b'{"name": "photo.pfm", "output": "photo.pfm", "kind": "disparity", "settings": "0", "key": "0"}\n'

_options = [
    Case(f"batch {' '.join(words)}", ("batch", *words), says=says)
    for words, says in (
        (("folder", "--to", "depth", "-o", "new"), "no photos"),
        (("missing", "--to", "depth", "-o", "new"), "missing"),
        (("photo.png", "--to", "depth", "-o", "new"), "photo.png"),
        ((".", "--to", "hologram", "-o", "../new"), "hologram"),
        ((".", "--to", "depth", "-o", "new"), "new"),
        ((".", "--to", "depth", "-o", "photo.png"), "photo.png"),
        ((".", "--to", "depth", "-o", "../new", "--frames", "3"), "--frames"),
        ((".", "--to", "depth", "-o", "../new", "--workers", "0"), "--workers"),
        ((".", "--to", "depth", "-o", "../new", "--workers", "2", "--scheduler", "tcp://127.0.0.1:1"), "--scheduler"),
        ((".", "--to", "depth", "-o", "../new", "--literal"), "--grid"),
        ((".", "--to", "depth", "-o", "../new", "--gloss", "missing"), "missing"),
        ((".", "--to", "hci", "-o", "../new", "--gloss", "photo.png"), "photo.png"),
        ((".", "--to", "depth", "-o", "../new", *TLS), "--tls-ca"),
        ((".", "--to", "depth", "-o", "../new", "--scheduler", "tls://127.0.0.1:1", *TLS[:4]), "--tls-key"),
    )
]

_schedulers = [
    Case(f"batch by {' '.join(words)}", (*ELSEWHERE, *words), says=says, prepare=_make_album, environment=OWN_PROCESS,
         makes=("new",))
    for words, says in (
        (("tcp://127.0.0.1:1",), "tcp://127.0.0.1:1"),
        (("tls://127.0.0.1:1",), "--tls-ca"),
        (("tls://127.0.0.1:1", *TLS), "tls://127.0.0.1:1"),
        (("tls://127.0.0.1:1", *TLS[:5], "missing"), "missing"),
        (("tcp://127.0.0.1:1", *TLS), "tcp://127.0.0.1:1"),
        (("nonsense",), "nonsense"),
        (("",), "--scheduler"),
        (("http://127.0.0.1:1",), "http"),
        (("tcp://127.0.0.1:99999999",), "99999999"),
    )
]  # fmt: skip

_places = [
    Case(f"batch where {words}", EXPORTING, says=says, prepare=_with_exports(make))
    for words, says, make in (
        ("manifest.jsonl is a link to a photo", "manifest.jsonl", _linked("manifest.jsonl", f"{ALBUM}/photo.png")),
        ("manifest.jsonl is a photo's second name", "manifest.jsonl", _linked_hard("manifest.jsonl")),
        ("failures.csv is a link to a photo", "failures.csv", _linked("failures.csv", f"{ALBUM}/photo.png")),
        ("failures.csv is a photo's second name", "failures.csv", _linked_hard("failures.csv")),
        ("failures.csv is a pipe", "failures.csv", _pipe("failures.csv")),
        ("failures.csv is a device", "failures.csv", _linked("failures.csv", "/dev/zero")),
    )
]
_places += [
    Case("batch where exports are of another kind", EXPORTING, says="--to disparity", makes=("new/failures.csv",),
         prepare=_with_exports(_written("manifest.jsonl", OTHER_KIND))),
]  # fmt: skip
_forced = [
    Case(f"batch --force where {words}", (*EXPORTING, "--force"), says=says, prepare=_with_exports(make))
    for words, says, make in (
        ("manifest.jsonl is a link to a photo", "manifest.jsonl", _linked("manifest.jsonl", f"{ALBUM}/photo.png")),
        ("manifest.jsonl is a photo's second name", "manifest.jsonl", _linked_hard("manifest.jsonl")),
        ("manifest.jsonl is a pipe", "manifest.jsonl", _pipe("manifest.jsonl")),
        ("manifest.jsonl is a device", "manifest.jsonl", _linked("manifest.jsonl", "/dev/zero")),
        ("failures.csv is a pipe", "failures.csv", _pipe("failures.csv")),
    )
]

_working = [
    Case(f"batch {words}", EXPORTING, code, says, ("new",), {**OWN_PROCESS, **environment}, prepare, limits)
    for words, code, says, environment, prepare, limits in (
        ("in peace", 0, "", {}, _with_exports(), ()),
        ("after a deep line", 0, "", {}, _with_exports(_written("manifest.jsonl", b"[" * 200_000)), ()),
        ("after a huge line", 0, "", {}, _with_exports(_written("manifest.jsonl", b"9" * 20_000_000)), ()),
        ("with few open files", 0, "", {}, _make_album, ("--nofile=64",)),
        ("with hardly any open files", 2, "", {}, _make_album, ("--nofile=16",)),
    )
]

_kept = [
    Case(f"batch onto {words}", (*EXPORTING, *more), 2, "failures.csv",
         ("new/failures.csv", "new/manifest.jsonl", "new/other_depth.pfm"), OWN_PROCESS, _with_exports(make))
    for words, more, make in (
        ("a file of the user's", (), _written("photo_depth.pfm", b"mine")),
        ("a link to a photo", (), _linked("photo_depth.pfm", f"{ALBUM}/photo.png")),
        ("a link to a photo, --force", ("--force",), _linked("photo_depth.pfm", f"{ALBUM}/photo.png")),
        ("a link to nothing, --force", ("--force",), _linked("photo_depth.pfm", "nowhere.pfm")),
        ("a folder, --force", ("--force",), lambda folder: (folder / "new/photo_depth.pfm").mkdir()),
    )
]  # fmt: skip

BATCH_CASES = (*_options, *_schedulers, *_places, *_forced, *_working, *_kept)
