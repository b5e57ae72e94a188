"""What a batch has finished and what it could not: `manifest.jsonl` and `failures.csv` in the folder of its exports.

The manifest only grows, a line for every export that is there; of several about one name the last counts. A line that a
power cut left unfinished is passed over. Failures are those of the last run.
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from iibr_core.formats.files import is_file, is_folder
from iibr_core.formats.outputs import make_folder, require_folder_place
from iibr_core.types import InputError
from viewer.app.batch.task import Outcome, PhotoTask

try:
    import fcntl
except ImportError:  # not on this system: then two runs at once are not noticed
    fcntl = None  # type: ignore[assignment]

MANIFEST, FAILURES = "manifest.jsonl", "failures.csv"


def require_batch_place(folder: Path, inputs: Sequence[Path], may_replace: bool) -> None:
    """Raise InputError where exports may not go: into what is read, or, unless allowed, among files of others."""
    is_ours = is_folder(folder) and is_file(folder / MANIFEST)
    require_folder_place(folder, inputs, may_replace or is_ours)


class Ledger:
    """Of one folder of exports, which is made where it is missing. Use as a context manager."""

    def __init__(self, folder: Path) -> None:
        """Read what is finished. Raises InputError where that cannot be read or written, or another run writes it."""
        self.folder = folder
        make_folder(folder)
        try:
            self._manifest = open(folder / MANIFEST, "ab", buffering=0)  # noqa: SIM115
            _lock(self._manifest.fileno(), folder)
            self._finished = _read_manifest(folder / MANIFEST)
            _end_last_line(folder / MANIFEST, self._manifest)
            self._failures = open(  # noqa: SIM115
                folder / FAILURES, "w", encoding="utf-8", errors="surrogateescape", newline=""
            )
        except OSError as error:
            raise InputError(f"{folder}: cannot be written to ({error.strerror or error})") from error
        self._failed = csv.writer(self._failures)
        self._failed.writerow(("photo", "reason"))

    def __enter__(self) -> Ledger:
        """Nothing more to do."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close both files."""
        self._failures.close()
        self._manifest.close()

    def has(self, name: str, key: str) -> bool:
        """Whether the export of that name is there, made of the same."""
        known = self._finished.get(name)
        return known is not None and known[0] == key and os.path.lexists(self.folder / known[1])

    def add_finished(self, task: PhotoTask, outcome: Outcome) -> None:
        """One more export is there, on disk to stay: so is this line."""
        name, output = (os.path.relpath(path, self.folder) for path in (task.target, outcome.output))
        line = {
            "name": name,
            "output": output,
            "photo": task.photo,
            "key": task.key,
            "seconds": round(outcome.seconds, 3),
        }
        self._manifest.write(json.dumps(line).encode() + b"\n")
        os.fsync(self._manifest.fileno())
        self._finished[name] = task.key, output

    def add_failure(self, photo: str, reason: str) -> None:
        """A photo, and why nothing came of it."""
        self._failed.writerow((photo, " ".join(reason.split())))
        self._failures.flush()


def _read_manifest(path: Path) -> dict[str, tuple[str, str]]:
    """Key and output by the export's name; lines that are damaged are as if they were not there."""
    finished = {}
    with open(path, "rb") as file:
        for line in file:
            try:
                entry: Any = json.loads(line)
                finished[str(entry["name"])] = str(entry["key"]), str(entry["output"])
            except (ValueError, KeyError, TypeError):
                continue
    return finished


def _end_last_line(path: Path, manifest: Any) -> None:
    """What is written next begins a line of its own, whatever a power cut has left."""
    size = path.stat().st_size
    with open(path, "rb") as file:
        file.seek(max(size - 1, 0))
        if file.read(1) not in (b"", b"\n"):
            manifest.write(b"\n")


def _lock(descriptor: int, folder: Path) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise InputError(f"{folder}: another batch is writing there; wait for it, or choose another folder") from error
