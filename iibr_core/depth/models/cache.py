"""Estimates kept on disk, as by the photo's pixels and the model's files; the least recently used go.

A cache that cannot be read or written counts as empty.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import cast

import numpy as np
from platformdirs import user_cache_path

from iibr_core.depth.estimate import DepthEstimate, Meaning
from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage, InputError

MAX_BYTES = 512 * 2**20
SECONDS_FILE = "seconds.json"


def cache_folder() -> Path:
    """Return the user's folder for estimates; it may not exist yet."""
    return user_cache_path("iibr", appauthor=False) / "depth"


def key_of(pixels: FloatImage, files: Iterable[Path]) -> str:
    """Return a name for a model's estimate of a picture (H, W, 3), by path, size and time of each of its files."""
    digest = hashlib.sha256(f"3 {pixels.shape}".encode())  # raise the number when the meaning of estimates changes
    for file in files:
        status = file.stat() if file.is_file() else None
        digest.update(os.fsencode(file.resolve()))
        digest.update(f"{status.st_size} {status.st_mtime_ns}".encode() if status else b"none")
    digest.update(np.ascontiguousarray(pixels).data)
    return digest.hexdigest()


def load(key: str) -> DepthEstimate | None:
    """Return the estimate of this key, None if there is none or it is damaged."""
    kept = load_map(key)
    with suppress(ValueError, TypeError):
        meaning, focal_ratio = json.loads(kept[1] if kept is not None else "")
        return None if kept is None else DepthEstimate(kept[0], cast(Meaning, meaning), focal_ratio)
    return None


def store(key: str, estimate: DepthEstimate) -> None:
    """Keep an estimate; the least recently used ones go if all exceed MAX_BYTES."""
    store_map(key, estimate.values, json.dumps([estimate.meaning, estimate.focal_ratio]))


def load_map(key: str) -> tuple[FloatImage, str] | None:
    """Return the values (H, W) of this key and the text about them, None if there are none or they are damaged."""
    path = cache_folder() / f"{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as kept:
            found = np.array(kept["values"], np.float32), str(kept["meaning"])
        os.utime(path)
    except Exception:  # missing, or damaged in one of the many ways that numpy meets
        return None
    return found


def store_map(key: str, values: FloatImage, meaning: str) -> None:
    """Keep values (H, W) with a text about them, as `store` does."""
    folder = cache_folder()
    with suppress(OSError, InputError):  # read-only or full: the estimate is made again the next time
        folder.mkdir(parents=True, exist_ok=True)
        with write_file(folder / f"{key}.npz") as temporary:
            np.savez(temporary, meaning=meaning, values=values)
        total = 0
        for entry in sorted(folder.glob("*.npz"), key=lambda entry: entry.stat().st_mtime_ns, reverse=True):
            total += entry.stat().st_size
            if total > MAX_BYTES and entry.stem != key:
                entry.unlink(missing_ok=True)


def seconds_of(model: str) -> float | None:
    """Return the time that a model's last estimate took on this machine, in seconds; None if there was none."""
    try:
        return float(json.loads((cache_folder() / SECONDS_FILE).read_text("utf-8"))[model])
    except (OSError, ValueError, TypeError, KeyError):
        return None


def note_seconds(model: str, seconds: float) -> None:
    """Note the time that a model's estimate took."""
    path, noted = cache_folder() / SECONDS_FILE, {}
    with suppress(OSError, ValueError, TypeError):
        noted = dict(json.loads(path.read_text("utf-8")))
    with suppress(OSError, InputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with write_file(path) as temporary:
            temporary.write_text(json.dumps(noted | {model: seconds}), "utf-8")
