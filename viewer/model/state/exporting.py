"""Exports: what the user says about one, what the window says of it, and the actions that change that."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.exports.options import USUAL_OPTIONS, ExportOptions


@dataclass(frozen=True)
class ExportPrompt:
    """The question what to export, by the name of its kind, and where to. already_there: there is something. problem:
    why it cannot be exported so.
    """

    kind: str
    path: str
    options: ExportOptions = USUAL_OPTIONS
    already_there: bool = False
    problem: str = ""


@dataclass(frozen=True)
class ExportTask:
    """Export the scene as this kind."""

    kind: str
    path: str
    options: ExportOptions = USUAL_OPTIONS
    may_replace: bool = False


@dataclass(frozen=True)
class AskToExport:
    """Ask what to export, and where to."""
