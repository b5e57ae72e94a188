"""State and actions of exports."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.exports.kinds import DEFAULT_OPTIONS, ExportOptions


@dataclass(frozen=True)
class ExportPrompt:
    """The prompt of an export.

    kind: name of its kind. already_there: whether the file exists. problem: reason why it cannot be exported.
    """

    kind: str
    path: str
    options: ExportOptions = DEFAULT_OPTIONS
    already_there: bool = False
    problem: str = ""


@dataclass(frozen=True)
class ExportTask:
    """A request to export the scene as this kind."""

    kind: str
    path: str
    options: ExportOptions = DEFAULT_OPTIONS
    may_replace: bool = False
