"""Records of depth models and tasks about them; `viewer.model.depth_models` has the verbs."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.beyond.optics import Optics


@dataclass(frozen=True)
class ModelOffer:
    """A depth model that is known or was copied here. host: source of its download. words: one line about it. is_here:
    whether it is on this machine. lacks: end of a sentence that names a missing package, "" where none is missing.
    runs_as_installed: whether it needs no optional package.
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
    runs_as_installed: bool = False

    @property
    def is_ready(self) -> bool:
        """Whether it can run at once."""
        return self.is_here and not self.lacks


@dataclass(frozen=True)
class ModelsPrompt:
    """The list of models. selected: index of a model, None for the recommended model."""

    selected: int | None = None


@dataclass(frozen=True)
class Downloading:
    """A download under way. done, total: megabytes, rounded."""

    title: str
    done: int
    total: int


@dataclass(frozen=True)
class DepthModels:
    """Known depth models, and the choice of the user.

    known: () before they were listed. asked: name or path of the model that was chosen for the open photo, None
    without. offered_for: path of the photo that a model is offered for, None before the first offer. given_up: paths of
    photos whose estimate was stopped or failed. left_focus: focus of the session, if it belongs to the depth that is
    still to be estimated.
    """

    known: tuple[ModelOffer, ...] = ()
    asked: str | None = None
    downloading: Downloading | None = None
    left_focus: Optics | None = None
    offered_for: str | None = None
    given_up: frozenset[str] = frozenset()

    @property
    def recommended(self) -> ModelOffer | None:
        """The recommended model; None before the models are listed."""
        return next((offer for offer in self.known if offer.is_recommended), None)

    @property
    def smallest(self) -> ModelOffer | None:
        """The smallest model that runs as installed and is not here yet."""
        offers = (offer for offer in self.known if offer.runs_as_installed and not (offer.is_here or offer.lacks))
        return min(offers, key=lambda offer: offer.megabytes, default=None)
