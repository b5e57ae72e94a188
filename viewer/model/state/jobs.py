"""The queue of saves, copies and exports: what the window shows of it, and what changes it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

JobKind = Literal["picture", "map", "copy", "export"]

WAITING_FOR_VIEWS = "waiting for the views"
WRITING = "writing the file"
STOPPING = "stopping"


@dataclass(frozen=True)
class JobProgress:
    """One job of the queue. name: of its file or folder. doing: in words, "" while it waits for its turn. done: share
    of what it is doing, 0..1. left_s: seconds that this still takes, None where that is not known.
    """

    id: int
    kind: JobKind
    name: str
    doing: str = ""
    done: float = 0.0
    left_s: float | None = None

    @property
    def can_be_cancelled(self) -> bool:
        """A file that is being written is finished."""
        return self.doing not in (WRITING, STOPPING)


@dataclass(frozen=True)
class CancelJobTask:
    """Give up the job of this id; the others continue."""

    id: int
