"""Workers of a Dask scheduler that runs elsewhere."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from distributed import Client, WorkerPlugin
from distributed.scheduler import KilledWorker
from distributed.security import Security

from iibr_core.exports.batch.threads import thread_variables
from iibr_core.formats.files import require_file
from iibr_core.runtime.machine import THREADS_VARIABLE
from iibr_core.types import InputError

if TYPE_CHECKING:
    from iibr_core.exports.batch.workers import Workers

CONNECT_S = 30


class TlsFiles(NamedTuple):
    """PEM files by which both sides prove who they are."""

    ca: Path
    cert: Path
    key: Path


class ThreadsOfWorker(WorkerPlugin):
    """Sets how many threads a photo gets: Dask sets it for OMP and MKL only, and our pools would take every core."""

    name = "iibr-threads"

    def setup(self, worker: Any) -> None:
        """Before anything of the core is imported there. A worker that was started with its own number keeps it."""
        os.environ.update(thread_variables(int(os.environ.get(THREADS_VARIABLE, "1"))))


@contextmanager
def remote_workers(address: str, tls: TlsFiles | None) -> Iterator[Workers]:
    """Those of a scheduler; a photo takes one of a worker's threads. Raises InputError where it cannot be reached."""
    from iibr_core.exports.batch.workers import Workers

    with _silent(), _connect(address, tls) as client:
        try:
            client.wait_for_workers(1, timeout=CONNECT_S)
        except TimeoutError as error:
            raise InputError(f"--scheduler {address}: it has no workers; start some: dask worker {address}") from error
        client.register_plugin(ThreadsOfWorker())
        executor = client.get_executor(pure=False)
        try:
            yield Workers(executor, lambda: sum(client.nthreads().values()), KilledWorker)
        finally:
            with suppress(Exception):  # the scheduler may be gone
                executor.shutdown(wait=False)
                client.unregister_worker_plugin(ThreadsOfWorker.name)


def _connect(address: str, tls: TlsFiles | None) -> Client:
    for path in tls or ():
        require_file(path)
    security = tls and Security(
        tls_ca_file=str(tls.ca), tls_client_cert=str(tls.cert), tls_client_key=str(tls.key), require_encryption=True
    )
    try:
        return Client(address, timeout=CONNECT_S, security=security)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # SSL's errors are OSErrors
        way = "with --tls-ca, --tls-cert and --tls-key" if address.startswith("tls:") or tls else "with: dask scheduler"
        said = str(error).strip().partition("\n")[0]
        raise InputError(f"--scheduler {address}: no Dask scheduler answers ({said}); start one {way}") from error


@contextmanager
def _silent() -> Iterator[None]:
    """What goes wrong is reported once, by us. Each of Dask's loggers has a level of its own."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)
