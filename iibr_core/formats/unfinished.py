"""What lies hidden beside an output: the unfinished one, and the claim of who is to write where nothing is yet.

Both are locked while their process lives: not its number, which would mean nothing to another machine or container.
Whoever writes there next removes what nobody holds any more, and puts back what had been moved aside.
"""

from __future__ import annotations

import atexit
import os
import re
import shutil
import stat
from collections.abc import Callable
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path
from secrets import token_hex

from iibr_core.types import InputError

try:
    import fcntl
except ImportError:  # not on this system: then nothing is locked or claimed, and nothing removed for others
    fcntl = None  # type: ignore[assignment]

TEMPORARY_NAME = re.compile(r"\.iibr-[0-9a-f]{16}(\.\w{1,15})?")
NEW, OLD = "new", "old"


class Claims:
    """Places where nothing was, and where this process alone is to write. Paths are real ones."""

    def __init__(self) -> None:
        self._held: dict[Path, tuple[Path, int] | None] = {}  # the claim's file and lock, None where there can be none

    def __contains__(self, place: Path) -> bool:
        return place in self._held

    def take(self, place: Path) -> None:
        """Claim a place until `release`. Raises InputError where another process holds it."""
        if place not in self._held:
            self._held[place] = _take(place)

    def release(self, place: Path) -> None:
        """Written or given up: others may have it."""
        held = self._held.pop(place, None)
        if held is not None:
            with suppress(OSError):
                held[0].unlink()
            unlock(held[1])

    def release_all(self) -> None:
        """At the end of the process."""
        for place in list(self._held):
            self.release(place)


def _take(place: Path) -> tuple[Path, int] | None:
    """The claim's file and lock; None where there can be none. Raises InputError where another process holds it."""
    above = next(folder for folder in place.parents if os.path.isdir(folder))
    claim = above / f".iibr-{blake2b(os.fsencode(place), digest_size=8).hexdigest()}.claim"
    try:
        temporary, lock = make_temporary(above, lambda new: new.touch(exist_ok=False))
    except OSError:
        return None  # whoever writes says why
    try:
        os.link(temporary, claim)  # locked before it can be seen
    except FileExistsError:
        unlock(lock)
        lock = lock_of(claim, waits=False)  # where its process is gone
        if lock is None:
            raise InputError(f"{place}: another program is writing it; wait for it, or choose another name") from None
    except OSError:  # a file system without hard links
        unlock(lock)
        return None
    finally:
        temporary.unlink(missing_ok=True)
    return None if lock is None else (claim, lock)


CLAIMS = Claims()
atexit.register(CLAIMS.release_all)


def remove_leftovers(folder: Path) -> None:
    """Remove what processes that were killed while they wrote left in a folder; put back what they had moved aside."""
    found: list[Path] = []
    with suppress(OSError), os.scandir(folder) as entries:
        found = [Path(entry.path) for entry in entries if TEMPORARY_NAME.fullmatch(entry.name)]
    for path in found:
        lock = lock_of(path, waits=False)
        if lock is None:
            continue
        with suppress(OSError):
            if stat.S_ISDIR(os.fstat(lock).st_mode):
                remove_around(path)
            else:
                path.unlink()
        unlock(lock)


def remove_around(around: Path) -> None:
    """Remove the folder around a new and an old one. The old one goes back unless the new one took its place."""
    old = next(iter((around / OLD).glob("*")), None)
    if old is not None and os.path.lexists(around / NEW / old.name):
        if os.path.lexists(around.parent / old.name):
            return  # somebody made another one meanwhile: both are kept
        old.rename(around.parent / old.name)
    shutil.rmtree(around, ignore_errors=True)


def make_temporary(folder: Path, make: Callable[[Path], None], suffix: str = "") -> tuple[Path, int | None]:
    """A new file or folder in `folder`, and its lock. Its name does not depend on what it becomes: that may be long."""
    while True:
        path = folder / f".iibr-{token_hex(8)}{suffix}"
        make(path)
        lock = lock_of(path, waits=True)
        if lock is not None or os.path.lexists(path):
            return path, lock
        # else taken for a leftover before it was locked


def lock_of(path: Path, waits: bool) -> int | None:
    """A descriptor that keeps `path` locked while it is open; None where others hold it, it is gone, or there are no
    locks. A lock, not a process's number: that would mean nothing to another machine or container.
    """
    if fcntl is None:
        return None
    descriptor = None
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        if os.path.samestat(os.fstat(descriptor), os.lstat(path)):
            return descriptor
    except OSError:
        pass
    unlock(descriptor)
    return None


def unlock(descriptor: int | None) -> None:
    """Let go of what `lock_of` returned."""
    if descriptor is not None:
        os.close(descriptor)
