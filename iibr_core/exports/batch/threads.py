"""How many threads a photo gets in a worker. Light: a worker reads it before the core is imported there."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from iibr_core.runtime.machine import THREADS_VARIABLE

LIBRARIES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
QUIET_AND_SAFE = {"PYTHONWARNINGS": "ignore", "PYTHONSAFEPATH": "1"}
"""Workers write nothing to the terminal, and import nothing that lies in the working folder."""


def thread_variables(threads: int) -> dict[str, str]:
    """What says to this program's own pools, and to those of libraries, how many threads there are."""
    return dict.fromkeys((THREADS_VARIABLE, *LIBRARIES), str(threads))


@contextmanager
def set_environment(variables: Mapping[str, str]) -> Iterator[None]:
    """The environment of processes that are started in the block; this one keeps what it has read of its own."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
