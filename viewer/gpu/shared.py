"""GL objects with several holders: they are freed with the last holder, in the thread of their context."""

from __future__ import annotations

from collections.abc import Callable


class Holders:
    """Counts the holders of GL objects, which each call `release` once. free: called by the last."""

    def __init__(self, free: Callable[[], None]) -> None:
        self._free = free
        self._count = 1

    @property
    def is_shared(self) -> bool:
        """Whether there are several holders."""
        return self._count > 1

    def add(self) -> None:
        """Count a holder."""
        self._count += 1

    def release(self) -> None:
        """Count a holder less."""
        self._count -= 1
        if self._count == 0:
            self._free()
