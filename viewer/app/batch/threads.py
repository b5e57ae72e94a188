"""How many threads a photo gets in a worker. Nothing heavy: it is heard before the core is imported there."""

from __future__ import annotations

import os
from typing import Any

from distributed import WorkerPlugin

from iibr_core.runtime.machine import THREADS_VARIABLE

LIBRARIES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


class ThreadsOfWorker(WorkerPlugin):
    """Says to this program's own pools, and to those of the libraries, how many threads a photo gets.

    Dask says so to OMP and MKL only; our pools would take every core in every worker.
    """

    name = "iibr-threads"

    def __init__(self, threads: int) -> None:
        """threads: of each worker."""
        self.threads = threads

    def setup(self, worker: Any) -> None:
        """Before anything of the core is imported there. A worker that was started with its own number keeps it."""
        os.environ.setdefault(THREADS_VARIABLE, str(self.threads))
        for name in LIBRARIES:
            os.environ[name] = os.environ[THREADS_VARIABLE]
