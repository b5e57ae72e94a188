"""Depth models: what the window offers, what is being downloaded, what is wanted; the tasks and actions about them."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.beyond.optics import Optics


@dataclass(frozen=True)
class ModelOffer:
    """A depth model as it is offered. host: where it would come from. words: a line about it. is_here: on this machine.
    lacks: what else must be installed to run it, and how; "" where nothing must.
    """

    name: str
    title: str
    megabytes: int
    licence: str
    host: str = ""
    words: str = ""
    is_here: bool = False
    lacks: str = ""
    is_recommended: bool = False

    @property
    def is_ready(self) -> bool:
        """Whether it can be asked at once."""
        return self.is_here and not self.lacks


@dataclass(frozen=True)
class ModelsPrompt:
    """The list of models. selected: the index of one, None for the recommended one."""

    selected: int | None = None


@dataclass(frozen=True)
class Downloading:
    """A model on its way here. done, total: megabytes, about."""

    title: str
    done: int
    total: int


@dataclass(frozen=True)
class DepthModels:
    """What is known and wanted of depth models.

    known: those to be had, () before they were looked for. asked: name or path of the one that the open photo's depth
    is to come from, None where nobody chose one. dismissed, given_up: paths of photos, in this run: the offer was sent
    away; their estimate was cancelled or failed. left_focus: what the open photo was left with, where that is of the
    depth that is still to be estimated.
    """

    known: tuple[ModelOffer, ...] = ()
    asked: str | None = None
    downloading: Downloading | None = None
    left_focus: Optics | None = None
    dismissed: frozenset[str] = frozenset()
    given_up: frozenset[str] = frozenset()

    @property
    def recommended(self) -> ModelOffer | None:
        """None before it is known."""
        return next((offer for offer in self.known if offer.is_recommended), None)


@dataclass(frozen=True)
class ListModelsTask:
    """Look which models there are, and which of them are here."""


@dataclass(frozen=True)
class GetModelTask:
    """Download the model of this name, and use it for the photo that is open."""

    name: str


@dataclass(frozen=True)
class CancelGetTask:
    """Give up the download; what came of it is kept for the next time."""


@dataclass(frozen=True)
class ModelsListed:
    """These are to be had."""

    known: tuple[ModelOffer, ...]


@dataclass(frozen=True)
class DownloadingChanged:
    """Another model is being downloaded, or more of it is here; None: nothing is any more."""

    downloading: Downloading | None


@dataclass(frozen=True)
class GetDepth:
    """Estimate depth with the recommended model, which is downloaded first unless it is here; and from now on that of
    every photo without depth.
    """


@dataclass(frozen=True)
class UseModel:
    """Estimate the open photo's depth with this model, a name or a path."""

    model: str


@dataclass(frozen=True)
class ShowOffer:
    """Offer the recommended model for the open photo, or do so no more in this run."""

    is_shown: bool


@dataclass(frozen=True)
class GiveUpEstimate:
    """Keep the depth that the open photo has."""


@dataclass(frozen=True)
class DepthEstimated:
    """The open photo has another depth now, from this model: its views are to be made again."""

    model: str


ModelAction = ModelsListed | DownloadingChanged | GetDepth | UseModel | ShowOffer | GiveUpEstimate | DepthEstimated
