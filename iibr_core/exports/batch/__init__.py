"""Whole archives: every photo of some folders, exported by worker processes on this machine or others.

What the viewer asks for has its name here, and is imported once it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iibr_core.runtime.offers import offered_by

if TYPE_CHECKING:
    from iibr_core.exports.batch.archive import photos_in
    from iibr_core.exports.batch.ledger import FAILURES, Ledger, require_batch_place
    from iibr_core.exports.batch.processes import local_workers
    from iibr_core.exports.batch.run import run_batch, workers_here
    from iibr_core.exports.batch.scheduler import TlsFiles, remote_workers
    from iibr_core.exports.batch.task import BatchSettings
    from iibr_core.exports.batch.workers import WorkerSource
else:
    __getattr__ = offered_by(__file__)
