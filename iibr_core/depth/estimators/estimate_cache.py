"""Estimates kept on disk by what they were made of: the photo's pixels, the model's files, the options. Bounded.
Beside them, how long each model took.

A cache that cannot be read or written is as if it were empty: nothing depends on it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
from platformdirs import user_cache_path

from iibr_core.depth.estimate import DepthEstimate, Meaning
from iibr_core.formats.files import read_text
from iibr_core.formats.maps import npy
from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage, InputError

MAX_BYTES = 512 * 2**20
FORMAT = "1"
"""Part of every key: raise it when estimates mean something else."""

TIMES = "seconds.json"
"""Beside the estimates: how long models took."""

# What numpy, zipfile and zlib raise for damaged files; RuntimeError: encrypted, or compressed in an unknown way.
MISREADINGS = (*npy.MISREADINGS, OSError, KeyError, RuntimeError, zipfile.BadZipFile, zlib.error)


def cache_folder() -> Path:
    """The user's folder for estimates; it may not exist yet."""
    return user_cache_path("iibr", appauthor=False) / "depth"


def key_of(pixels: FloatImage, files: Iterable[Path], options: str) -> str:
    """A name for what a model makes of a picture: the same for the same contents, wherever they lie. files: all that
    the model is read from; those that are missing count as such.
    """
    digest = hashlib.blake2b(digest_size=20)
    digest.update(f"{FORMAT} {pixels.shape} {options} ".encode())
    digest.update(np.ascontiguousarray(pixels).data)
    for path in files:
        with contextlib.suppress(OSError), path.open("rb") as file:
            digest.update(os.fsencode(path.name))
            digest.update(hashlib.file_digest(file, "blake2b").digest())
    return digest.hexdigest()


def load(key: str) -> DepthEstimate | None:
    """What was kept under this key, None where nothing was or it is damaged."""
    path = cache_folder() / f"{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as kept:
            meaning, values = str(kept["meaning"]), np.array(kept["values"], np.float32)
        if values.ndim != 2 or meaning not in get_args(Meaning):
            return None
        with contextlib.suppress(OSError):
            os.utime(path)  # the least recently used go first
        return DepthEstimate(values, cast(Meaning, meaning))
    except MISREADINGS:
        return None


def store(key: str, estimate: DepthEstimate) -> None:
    """Keep an estimate; the least recently used ones go where all exceed MAX_BYTES."""
    folder = cache_folder()
    # read-only or full: the estimate is made again the next time
    with contextlib.suppress(OSError, InputError):
        folder.mkdir(parents=True, exist_ok=True)
        with write_file(folder / f"{key}.npz") as temporary:
            np.savez(temporary, meaning=estimate.meaning, values=estimate.values)
        _make_room(folder)


def store_seconds(title: str, seconds: float) -> None:
    """Keep how long a model of this title took for a photo on this machine, the last time."""
    with contextlib.suppress(OSError, InputError), write_file(cache_folder() / TIMES) as temporary:
        temporary.write_text(json.dumps({**_times(), title: round(seconds, 2)}, indent=1) + "\n", "utf-8")


def seconds_of(title: str) -> float | None:
    """How long a model of this title took here, None where it never ran."""
    seconds = _times().get(title)
    return seconds if isinstance(seconds, int | float) and 0 <= seconds < math.inf else None


def _times() -> dict[str, Any]:
    try:
        told = json.loads(read_text(cache_folder() / TIMES))
    except (OSError, ValueError, RecursionError):
        return {}
    return told if isinstance(told, dict) else {}


def _make_room(folder: Path) -> None:
    kept = sorted(((entry.stat(), entry) for entry in folder.glob("*.npz")), key=lambda item: item[0].st_mtime_ns)
    total = sum(status.st_size for status, _ in kept)
    for status, entry in kept[:-1]:
        if total <= MAX_BYTES:
            return
        entry.unlink(missing_ok=True)
        total -= status.st_size
