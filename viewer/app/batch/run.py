"""A batch from beginning to end: what is new or changed goes to the workers, what comes back into the ledger."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

from iibr_core.runtime.machine import (
    LEAST_USUAL_BYTES,
    MOST_USUAL_SHARE,
    core_count,
    memory_bytes,
    usual_budget_bytes,
)
from iibr_core.types import InputError, ReportProgress
from viewer.app.batch.archive import ArchivePhoto
from viewer.app.batch.ledger import Ledger
from viewer.app.batch.task import BatchSettings, Outcome, PhotoTask, key_of, target_name


@dataclass
class BatchCount:
    """Photos of a batch, as far as it has come."""

    total: int
    written: int = 0
    there_before: int = 0
    failed: int = 0

    @property
    def done(self) -> int:
        """Those that need nothing more."""
        return self.written + self.there_before + self.failed


class _Batch:
    def __init__(
        self, ledger: Ledger, settings: BatchSettings, photos: Sequence[ArchivePhoto], report_progress: ReportProgress
    ) -> None:
        self.count = BatchCount(len(photos))
        self._ledger, self._settings, self._photos, self._report_progress = ledger, settings, photos, report_progress

    def tasks(self, share_bytes: int | None) -> Iterator[PhotoTask]:
        """Those photos whose exports are not there, each looked at when it is asked for."""
        for photo in self._photos:
            name = target_name(self._settings, photo)
            try:
                key = key_of(self._settings, photo)
                if not self._ledger.has(name, key):
                    target = os.path.abspath(self._ledger.folder / name)
                    yield PhotoTask(os.path.abspath(photo.path), target, key, self._settings, share_bytes)
                    continue
                self.count.there_before += 1
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
        self._tell("exporting")

    def _fail(self, photo: str, reason: str) -> None:
        self._ledger.add_failure(photo, reason)
        self.count.failed += 1

    def _tell(self, doing: str) -> None:
        self._report_progress(self.count.done, self.count.total, doing)


def run_batch(
    ledger: Ledger,
    settings: BatchSettings,
    photos: Sequence[ArchivePhoto],
    workers: int | str | None,
    report_progress: ReportProgress,
) -> BatchCount:
    """Export what is not there yet. workers: so many processes here, as many as fit, or a scheduler's address.

    None are started where there is nothing to do. Raises InputError where there are none, or they are lost.
    """
    batch = _Batch(ledger, settings, photos, report_progress)
    count = workers if isinstance(workers, int) else _usual_workers()
    share_bytes = None if isinstance(workers, str) else _share_bytes(count)
    tasks = batch.tasks(share_bytes)
    first = next(tasks, None)
    if first is None:
        return batch.count
    from viewer.app.batch.cluster import local_workers, outcomes_of, remote_workers, warm_workers

    report_progress(0, 0, "starting workers")
    threads = max(core_count() // count, 1)
    with remote_workers(workers) if isinstance(workers, str) else local_workers(count, threads) as client:
        report_progress(0, 0, "warming up")
        warm_workers(client, settings, share_bytes)
        for task, outcome in outcomes_of(client, chain((first,), tasks)):
            batch.take(task, outcome)
    return batch.count


def _usual_workers() -> int:
    """One a core, as far as there is memory for them."""
    return max(min(core_count(), int(MOST_USUAL_SHARE * memory_bytes()) // LEAST_USUAL_BYTES), 1)


def _share_bytes(workers: int) -> int:
    """Of the memory, for each."""
    return min(usual_budget_bytes(), int(MOST_USUAL_SHARE * memory_bytes()) // workers)
