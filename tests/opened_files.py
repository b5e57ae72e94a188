"""Whether a file was opened, by any process and any library: the kernel says so (inotify)."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

IN_OPEN = 0x20


class Watch:
    """Of one file, from when it is made."""

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path, self._descriptor = path, descriptor

    def was_opened(self) -> bool:
        """Since the last call."""
        try:
            return bool(os.read(self._descriptor, 4096))
        except BlockingIOError:
            return False


@contextmanager
def watch(path: Path) -> Iterator[Watch]:
    """Watch a file; proves first that an open is seen."""
    if sys.platform != "linux":
        pytest.skip("watching a file needs Linux's inotify")
    kernel = ctypes.CDLL(None, use_errno=True)
    descriptor = kernel.inotify_init1(os.O_NONBLOCK)
    try:
        assert kernel.inotify_add_watch(descriptor, os.fsencode(path), IN_OPEN) > 0
        watched = Watch(path, descriptor)
        path.open("rb").close()
        assert watched.was_opened()
        yield watched
    finally:
        os.close(descriptor)
