"""How many windows of this program are open beside this one: each takes a numbered slot, so that none hides another."""

from __future__ import annotations

import os
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: every window takes the first slot there
    fcntl = None  # type: ignore[assignment]

SLOTS = 8
STEP = 32
"""A window opens so much (screen units) farther right and down than the one of the slot before."""


class WindowSlot:
    """The first slot that no other window has; given back by `close`, and by the system when the program dies."""

    def __init__(self, folder: Path | None) -> None:
        """folder: of the user's preferences; None, and a folder that cannot be written: the first slot."""
        self.number = 0
        self._descriptor: int | None = None
        if folder is None or fcntl is None:
            return
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._take(folder)
        except OSError:
            self.number = 0

    def shift(self, place: tuple[int, int, int, int] | None) -> tuple[int, int, int, int] | None:
        """The place (x, y, width, height) for a window of this slot."""
        if place is None:
            return None
        x, y, width, height = place
        return x + STEP * self.number, y + STEP * self.number, width, height

    def close(self) -> None:
        """Give the slot back."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _take(self, folder: Path) -> None:
        for number in range(SLOTS):
            descriptor = os.open(folder / f"window-{number}.lock", os.O_RDWR | os.O_CREAT, 0o600)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                continue
            self.number, self._descriptor = number, descriptor
            return
        self.number = SLOTS
