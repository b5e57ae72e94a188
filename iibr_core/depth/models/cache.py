"""Estimates kept on disk by the photo's pixels and the model's files; the least recently used go.

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
    path = cache_folder() / f"{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as kept:
            focal = float(kept["focal_ratio"])
            meaning = cast(Meaning, str(kept["meaning"]))
            estimate = DepthEstimate(np.array(kept["values"], np.float32), meaning, focal or None)
        os.utime(path)
    except Exception:  # missing, or damaged in one of the many ways that numpy meets
        return None
    return estimate


def store(key: str, estimate: DepthEstimate) -> None:
    """Keep an estimate; the least recently used ones go if all exceed MAX_BYTES."""
    folder = cache_folder()
    with suppress(OSError, InputError):  # read-only or full: the estimate is made again the next time
        folder.mkdir(parents=True, exist_ok=True)
        with write_file(folder / f"{key}.npz") as temporary:
            focal = estimate.focal_ratio or 0.0
            np.savez(temporary, meaning=estimate.meaning, values=estimate.values, focal_ratio=focal)
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
    with suppress(OSError, ValueError):
        noted = dict(json.loads(path.read_text("utf-8")))
    with suppress(OSError, InputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with write_file(path) as temporary:
            temporary.write_text(json.dumps(noted | {model: seconds}), "utf-8")
