"""Exports: what the user says about one, what the window says of it, and the actions that change that."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from viewer.model.layout import ScreenSize

AnimationKind = Literal["circle", "eight", "swing", "focus", "aperture"]
ANIMATIONS: tuple[AnimationKind, ...] = ("circle", "eight", "swing", "focus", "aperture")
"""What moves: the viewpoint on a loop, or what is sharp from near to far and back, or the aperture."""


@dataclass(frozen=True)
class ExportOptions:
    """None leaves a choice to the kind.

    size: (width, height) of each picture in pixels. device: a display by name, see `DEVICES`. eyes: view steps between
    the two eyes. motion: of an animation. keys: file of a path of one's own. frames: of one turn, or pictures of a
    stack. rate: frames a second. row: of the picture. show: on a display, once it is written.
    """

    size: ScreenSize | None = None
    device: str | None = None
    eyes: float | None = None
    motion: AnimationKind | None = None
    keys: Path | None = None
    frames: int | None = None
    rate: float | None = None
    row: int | None = None
    show: bool = False


USUAL_OPTIONS = ExportOptions()


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
