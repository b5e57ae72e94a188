"""GL objects with more than one holder: they are freed with the last of them, in the thread of their context."""

from __future__ import annotations

from collections.abc import Callable


class Holders:
    """Counts who holds some GL objects. Each calls `release` once; free: called by the last."""

    def __init__(self, free: Callable[[], None]) -> None:
        self._free = free
        self._count = 1

    @property
    def is_shared(self) -> bool:
        """Whether there is more than one."""
        return self._count > 1

    def add(self) -> None:
        """One more."""
        self._count += 1

    def release(self) -> None:
        """One less."""
        self._count -= 1
        if self._count == 0:
            self._free()
