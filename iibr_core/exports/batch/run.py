"""A batch from beginning to end: what is new or changed goes to the workers, what comes back into the ledger."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path

from iibr_core.exports.batch.archive import ArchivePhoto
from iibr_core.exports.batch.ledger import Ledger
from iibr_core.exports.batch.processes import local_workers
from iibr_core.exports.batch.task import BatchSettings, Outcome, PhotoTask, key_of, target_name
from iibr_core.exports.batch.work import export_photo
from iibr_core.exports.batch.workers import WorkerSource, outcomes_of
from iibr_core.exports.export_opening import OpenDrawn
from iibr_core.exports.writers import gallery_of
from iibr_core.formats.unfinished import remove_leftovers
from iibr_core.runtime.machine import LEAST_USUAL_BYTES, MOST_USUAL_SHARE, core_count, memory_bytes, usual_budget_bytes
from iibr_core.types import InputError, ReportProgress


@dataclass
class BatchCount:
    """Numbers of photos of a batch, as far as it has come. guessed: those with guessed depth."""

    total: int
    written: int = 0
    there_before: int = 0
    failed: int = 0
    guessed: int = 0

    @property
    def exported(self) -> int:
        """Photos whose exports are there."""
        return self.written + self.there_before

    @property
    def done(self) -> int:
        """Photos that need nothing more."""
        return self.exported + self.failed


class _Batch:
    def __init__(
        self, ledger: Ledger, settings: BatchSettings, photos: Sequence[ArchivePhoto], report_progress: ReportProgress
    ) -> None:
        self.count = BatchCount(len(photos))
        self.folders: set[Path] = set()
        """Where workers write."""
        self._ledger, self._settings, self._photos, self._report_progress = ledger, settings, photos, report_progress

    def tasks(self, share_bytes: int | None) -> Iterator[PhotoTask]:
        """Those photos whose exports are not there, each looked at when it is asked for."""
        for photo in self._photos:
            name = target_name(self._settings, photo)
            try:
                key = key_of(self._settings, photo)
                if not self._ledger.has(name, key):
                    place = self._ledger.place_of(name)
                    self.folders.add(place.target.parent)
                    yield PhotoTask(os.path.abspath(photo.path), place, key, self._settings, share_bytes)
                    continue
                self.count.there_before += 1
                self.count.guessed += self._ledger.is_guess(name)
            except InputError as error:
                self._fail(photo.path, str(error))
            self._tell("looking")

    def take(self, task: PhotoTask, outcome: Outcome) -> None:
        """What became of a photo."""
        if outcome.reason:
            self._fail(task.photo, outcome.reason)
        else:
            self._ledger.add_finished(task, outcome)
            self.count.written += 1
            self.count.guessed += outcome.is_guess
        self._tell("exporting")

    def _fail(self, photo: str, reason: str) -> None:
        self._ledger.add_failure(photo, reason)
        self.count.failed += 1

    def _tell(self, doing: str) -> None:
        before = self.count.there_before  # those took no work
        self._report_progress(self.count.done - before, self.count.total - before, doing)


def run_batch(
    ledger: Ledger,
    settings: BatchSettings,
    photos: Sequence[ArchivePhoto],
    source: WorkerSource,
    open_drawn: OpenDrawn | None,
    report_progress: ReportProgress,
) -> BatchCount:
    """Export what is not there yet. No workers are started where there is nothing to do. open_drawn: a function that
    they can import, for kinds that are drawn; else None.

    Raises InputError where exports of other settings are in the way, there are no workers, or they are lost.
    """
    ledger.require_same_settings(settings, [target_name(settings, photo) for photo in photos])
    batch = _Batch(ledger, settings, photos, report_progress)
    tasks = batch.tasks(source.memory_bytes)
    first = next(tasks, None)
    if first is None:
        _list_exports(ledger, settings)
        return batch.count
    report_progress(0, 0, "starting workers")
    try:
        with source.open() as workers:
            for task, outcome in outcomes_of(
                workers, chain((first,), tasks), partial(export_photo, open_drawn=open_drawn)
            ):
                batch.take(task, outcome)
    finally:
        for folder in batch.folders:
            remove_leftovers(folder)
    _list_exports(ledger, settings)
    return batch.count


def _list_exports(ledger: Ledger, settings: BatchSettings) -> None:
    """Where the kind has such a list. Raises InputError where it cannot be written."""
    write_gallery = gallery_of(settings.export_kind)
    if write_gallery is not None:
        write_gallery(ledger.folder, ledger.outputs(settings.kind))


def workers_here(count: int | None = None) -> WorkerSource:
    """So many processes of this machine, or as many as fit, each with its part of the cores and the memory."""
    count = count or _usual_workers()
    return WorkerSource(partial(local_workers, count, max(core_count() // count, 1)), _share_bytes(count))


def _usual_workers() -> int:
    """One a core, as far as there is memory for them."""
    return max(min(core_count(), int(MOST_USUAL_SHARE * memory_bytes()) // LEAST_USUAL_BYTES), 1)


def _share_bytes(workers: int) -> int:
    """Of the memory, for each."""
    return min(usual_budget_bytes(), int(MOST_USUAL_SHARE * memory_bytes()) // workers)
