"""What a batch has finished and what it could not: `manifest.jsonl` and `failures.csv` in the folder of its exports.

The manifest only grows, a line for every export that is there; the last one about a name counts. A damaged line is
skipped. What no line names is not replaced. Failures are those of the last run.
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

from iibr_core.exports.batch.task import CLAIM_PREFIX, BatchSettings, Outcome, PhotoTask, Place
from iibr_core.formats.files import is_file, is_folder
from iibr_core.formats.outputs import check_output_folder, make_folder, open_to_append
from iibr_core.types import InputError

try:
    import fcntl
except ImportError:  # not on this system: then two runs at once are not noticed
    fcntl = None  # type: ignore[assignment]

MANIFEST, FAILURES = "manifest.jsonl", "failures.csv"
MOST_LINE_BYTES = 1 << 17
"""Of the manifest: three paths of 4096 bytes take less, each byte written as six."""


def require_batch_place(folder: Path, inputs: Sequence[Path], may_replace: bool) -> None:
    """Raise InputError where exports may not go: into what is read, or, unless allowed, among files of others."""
    is_ours = is_folder(folder) and is_file(folder / MANIFEST)
    check_output_folder(folder, inputs, may_replace or is_ours)


class Entry(NamedTuple):
    """A line of the manifest. output: in the folder. settings: their digest. key: "" for what may be unfinished.
    is_guess: whether the photo's depth was guessed.
    """

    name: str
    output: str
    kind: str
    settings: str
    key: str
    is_guess: bool = False


class Ledger:
    """Of one folder of exports, which is made where it is missing. Use as a context manager."""

    def __init__(self, folder: Path, may_replace: bool = False) -> None:
        """Read what is finished. may_replace: also what no batch wrote, or one with other settings.

        Raises InputError where that cannot be read or written, or another run writes it.
        """
        self.folder = folder
        self._may_replace = may_replace
        make_folder(folder)
        self._manifest = os.fdopen(open_to_append(folder / MANIFEST), "r+b", buffering=0)
        try:
            self._read()
        except BaseException as error:
            self._manifest.close()
            if not isinstance(error, OSError):
                raise
            raise InputError(f"{folder}: cannot be written to ({error.strerror or error})") from error
        self._failed = csv.writer(self._failures)
        self._failed.writerow(("photo", "reason"))

    def _read(self) -> None:
        _lock(self._manifest.fileno(), self.folder)
        _end_last_line(self._manifest)
        self._take_claims()
        failures = open_to_append(self.folder / FAILURES)
        os.truncate(failures, 0)
        self._failures = open(failures, "w", encoding="utf-8", errors="surrogateescape", newline="")  # noqa: SIM115

    def __enter__(self) -> Ledger:
        """Nothing more to do."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Close both files."""
        try:
            self._take_claims()
        finally:
            self._failures.close()
            self._manifest.close()

    def require_same_settings(self, settings: BatchSettings, names: Sequence[str]) -> None:
        """Raise InputError where an export of one of these names was made with other settings, unless it may go."""
        for name in () if self._may_replace else names:
            entry = self._entries.get(name)
            if entry is not None and entry.settings != settings.digest:
                other = f"--to {entry.kind}" if entry.kind != settings.kind else "other options"
                raise InputError(
                    f"{self.folder / entry.output}: was exported with {other}; choose another folder, or give --force"
                    " to replace it"
                )

    def place_of(self, name: str) -> Place:
        """Where the export of that name goes. Raises InputError where something is there that is not ours."""
        entry = self._entries.get(name)
        place = Place(os.path.abspath(self.folder), name, entry.output if entry is not None else "", self._may_replace)
        if entry is None and not self._may_replace and os.path.lexists(place.target):
            raise InputError(f"{place.target}: already exists, and no batch wrote it; give --force to replace it")
        return place

    def has(self, name: str, key: str) -> bool:
        """Whether the export of that name is there, made of the same."""
        known = self._entries.get(name)
        return known is not None and known.key == key and os.path.lexists(self.folder / known.output)

    def is_guess(self, name: str) -> bool:
        """Whether the export of that name was made with guessed depth."""
        return name in self._entries and self._entries[name].is_guess

    def outputs(self, kind: str) -> list[str]:
        """What is there of a kind, by its name in the folder."""
        entries = (entry for entry in self._entries.values() if entry.kind == kind and entry.key)
        return [entry.output for entry in entries if os.path.lexists(self.folder / entry.output)]

    def add_finished(self, task: PhotoTask, outcome: Outcome) -> None:
        """One more export is there, on disk to stay: so is this line."""
        about = {"photo": task.photo, "key": task.key, "seconds": round(outcome.seconds, 3)}
        self._add(task.line(outcome.output, **about, is_guess=outcome.is_guess))
        task.place.claim.unlink(missing_ok=True)

    def add_failure(self, photo: str, reason: str) -> None:
        """A photo, and why nothing came of it."""
        self._failed.writerow((photo, " ".join(reason.split())))
        self._failures.flush()

    def _add(self, line: bytes) -> None:
        self._manifest.write(line)
        os.fsync(self._manifest.fileno())
        self._entries.update((entry.name, entry) for entry in _entries_of(line))

    def _take_claims(self) -> None:
        """Read the manifest; what was written and not reported is ours, too: the next run replaces it."""
        # Again at the end: an interruption may have come between a line and what is known of it here.
        self._entries = {entry.name: entry for entry in _read_entries(self.folder / MANIFEST)}
        for path in self.folder.glob(f"{CLAIM_PREFIX}*"):
            for entry in _read_entries(path) if is_file(path) else ():
                if os.path.lexists(self.folder / entry.output) and not self.has(entry.name, entry.key):
                    self._add(json.dumps(entry._replace(key="")._asdict()).encode() + b"\n")
            path.unlink()


def _read_entries(path: Path) -> Iterator[Entry]:
    with open(path, "rb") as file:
        while line := file.readline(MOST_LINE_BYTES):
            if line.endswith(b"\n") or len(line) < MOST_LINE_BYTES:
                yield from _entries_of(line)
            while line and not line.endswith(b"\n"):  # the rest of what is too long for a line of ours
                line = file.readline(MOST_LINE_BYTES)


def _entries_of(line: bytes) -> Iterator[Entry]:
    """The entry of a line; none where it is damaged."""
    try:
        told: Any = json.loads(line)
        yield Entry(
            str(told["name"]),
            str(told["output"]),
            str(told.get("kind", "")),
            str(told.get("settings", "")),
            str(told.get("key", "")),
            bool(told.get("is_guess", False)),
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return


def _end_last_line(manifest: Any) -> None:
    """What is written next begins a line of its own, whatever a power cut has left."""
    size = os.fstat(manifest.fileno()).st_size
    manifest.seek(max(size - 1, 0))
    if manifest.read(1) not in (b"", b"\n"):
        manifest.write(b"\n")


def _lock(descriptor: int, folder: Path) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise InputError(f"{folder}: another batch is writing there; wait for it, or choose another folder") from error
