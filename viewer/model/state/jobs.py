"""Saves, copies and exports that wait or run, and exports that are done."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from viewer.model.state.prompts import ExportPrompt

JobKind = Literal["picture", "map", "copy", "export"]

WAITING_FOR_VIEWS = "waiting for the views"
WRITING = "writing the file"
STOPPING = "stopping"


@dataclass(frozen=True)
class JobProgress:
    """A job that waits or runs.

    name: of its file or folder. doing: its present step, "" while it waits for its turn. done: share of this step,
    0..1. left_s: seconds that the step still takes, None if not known.
    """

    id: int
    kind: JobKind
    name: str
    doing: str = ""
    done: float = 0.0
    left_s: float | None = None

    @property
    def can_be_cancelled(self) -> bool:
        """Whether it has not come to writing its file."""
        return self.doing not in (WRITING, STOPPING)


@dataclass(frozen=True)
class FinishedExport:
    """An export that was written or failed. prompt: asks for the same again. problem: why it failed."""

    path: str
    prompt: ExportPrompt
    problem: str = ""
