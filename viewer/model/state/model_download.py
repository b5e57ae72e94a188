"""Depth models to be had: what the window offers, what is being downloaded, and the tasks and actions about it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ModelOffer:
    """A depth model as it is offered. repository: where it is published. is_here: on this machine. lacks: what else
    must be installed to run it, and how; "" where nothing must.
    """

    name: str
    title: str
    megabytes: int
    licence: str
    repository: str
    is_here: bool = False
    lacks: str = ""


@dataclass(frozen=True)
class ModelsPrompt:
    """The question which model to get. selected: its index among the models."""

    models: tuple[ModelOffer, ...]
    selected: int = 0


@dataclass(frozen=True)
class ListModelsTask:
    """Look which models there are, and which of them are here, and ask which to get."""


@dataclass(frozen=True)
class GetModelTask:
    """Download the model of this name, and use it for the photo that is open."""

    name: str


@dataclass(frozen=True)
class CancelGetTask:
    """Give up the download; what came of it is kept for the next time."""


@dataclass(frozen=True)
class Downloading:
    """A model on its way here. done, total: megabytes, about."""

    title: str
    done: int
    total: int


@dataclass(frozen=True)
class DownloadingChanged:
    """Another model is being downloaded, or more of it is here; None: nothing is any more."""

    downloading: Downloading | None
