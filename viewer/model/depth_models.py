"""Depth by a model: which model the open photo needs, and the verbs about models."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import Scene, Source, source_with_depth
from viewer.model.action import Setter, setter
from viewer.model.messages import Notice, notify
from viewer.model.remedies import DEPTH_COMMANDS
from viewer.model.tasks import PlainTask

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


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


def keep_choice(state: AppState, source: Source) -> AppState:
    """Return the state in which a chosen model serves further photos, where another photo is opened while it works."""
    asked = state.models.asked
    if asked is None or state.source is None or state.source.path == source.path or _is_elsewhere(asked, state.models):
        return state
    return replace(state, preferences=replace(state.preferences, depth_model=asked, guesses_depth=False))


def wanted_model(state: AppState) -> str | None:
    """Return the name or path of the model that is to estimate depth now; None if no model is."""
    scene, models = _open_photo(state), state.models
    if scene is None or scene.source.path in models.given_up:
        return None
    choice, wanted = scene.source.depth, models.asked
    if choice.start == "model" or (scene.is_guessed and choice.start in ("auto", "embedded")):
        wanted = wanted or choice.model
        if wanted is None and (choice.start == "model" or not state.preferences.guesses_depth):
            wanted = usual_model(state)
    return None if wanted == scene.depth_model or _is_elsewhere(wanted, models) else wanted


def usual_model(state: AppState) -> str | None:
    """Return the model for photos without depth: the chosen one, else the first that is here, None if none is."""
    ready = (model.name for model in state.models.known if model.is_ready and model.runs_as_installed)
    return state.preferences.depth_model or next(ready, None)


def model_named(models: DepthModels, name: str) -> ModelOffer:
    """Return the listed model of this name, or the record of a file or folder."""
    listed = next((model for model in models.known if model.name == name), None)
    title = name.replace("\\", "/").rstrip("/").rpartition("/")[2]
    return listed or ModelOffer(name, title, 0, "your own", words=f"Your own: {name}", is_here=True)


def offered_model(state: AppState) -> ModelOffer | None:
    """Return the model that is offered for guessed depth; None if there is no offer: there is one in a run."""
    scene, models = _open_photo(state), state.models
    if scene is None or not scene.is_guessed or scene.source.depth.start == "rough":
        return None
    is_first = models.offered_for is None and state.preferences.offers_models
    is_offered = is_first or models.offered_for == scene.source.path
    if not is_offered or models.downloading is not None or wanted_model(state) is not None:
        return None
    usual = usual_model(state)
    return models.recommended if usual is None else model_named(models, usual)


set_known: Setter[tuple[ModelOffer, ...]] = setter("models.known")
"""Set the models that can be had."""


def set_downloading(state: AppState, downloading: Downloading | None) -> AppState:
    """Set the download under way; None: there is none, and a model that did not come is wanted no more."""
    models = state.models
    is_given_up = downloading is None and _is_elsewhere(models.asked, models)
    asked = None if is_given_up else models.asked
    return replace(state, models=replace(models, downloading=downloading, asked=asked))


def get_depth(state: AppState) -> AppState:
    """Estimate depth with a model that is here, else download the recommended one; so for all further photos."""
    scene, models, usual = _open_photo(state), state.models, usual_model(state)
    offer = models.recommended if usual is None else model_named(models, usual)
    if offer is None or offer.lacks:
        return state
    state = replace(state, preferences=replace(state.preferences, guesses_depth=False))
    if scene is not None:
        asked = offer.name if not scene.is_guessed else models.asked
        models = replace(models, asked=asked, given_up=models.given_up - {scene.source.path})
    state = replace(state, models=models)
    return state if offer.is_here else state.with_tasks(PlainTask("download model", offer.name))


def use_model(state: AppState, model: str) -> AppState:
    """Estimate the open photo's depth with a model, a name or a path; a known model is downloaded first if needed."""
    scene, models = _open_photo(state), state.models
    if scene is None:
        return state
    state = replace(state, models=replace(models, asked=model, given_up=models.given_up - {scene.source.path}))
    return state.with_tasks(PlainTask("download model", model)) if _is_elsewhere(model, models) else state


def show_models(state: AppState) -> AppState:
    """Show the list of models, as they are now."""
    return replace(state, prompt=ModelsPrompt()).with_tasks(PlainTask("list models"))


def show_offer(state: AppState, is_shown: bool) -> AppState:
    """Offer a model for the open photo, or close the offer for this run."""
    scene = _open_photo(state)
    if scene is None:
        return state
    return replace(state, models=replace(state.models, offered_for=scene.source.path if is_shown else ""))


def offer_no_more(state: AppState) -> AppState:
    """Close the offer for good; the chip of guessed depth still leads to it."""
    return show_offer(replace(state, preferences=replace(state.preferences, offers_models=False)), False)


def give_up(state: AppState) -> AppState:
    """Keep the depth that the open photo has, and close the offer of a model."""
    scene = _open_photo(state)
    if scene is None:
        return state
    given_up = state.models.given_up | {scene.source.path}
    return show_offer(replace(state, models=replace(state.models, asked=None, given_up=given_up)), False)


def report_failure(state: AppState, model: str, message: str) -> AppState:
    """Show why a model failed on the open photo; photos to come do not try it again unasked."""
    preferences, source = state.preferences, state.source
    if preferences.depth_model == model:
        state = replace(state, preferences=replace(preferences, depth_model=""))
    state = give_up(state)
    if source is not None and state.scene is not None and source.depth.model == model:
        source = replace(source, depth=replace(source.depth, model=None))
        state = replace(state, source=source, scene=replace(state.scene, source=source))
    return notify(state, Notice(message, is_error=True, commands=DEPTH_COMMANDS[1:], failed_model=model))


def take_estimate(state: AppState, model: str) -> AppState:
    """Make the views again from the depth that this model estimated. A model that was chosen stays the photo's own, and
    serves all further photos.
    """
    scene, models, preferences = _open_photo(state), state.models, state.preferences
    if scene is None:
        return state
    source = scene.source
    if models.asked is not None:
        source = source_with_depth(source, source.depth.start if scene.is_guessed else "model", model)
        preferences = replace(preferences, depth_model=model, guesses_depth=False)
    return replace(
        state,
        source=source,
        scene=replace(scene, source=source, depth_model=model),
        models=replace(models, asked=None),
        notices=tuple(notice for notice in state.notices if not notice.failed_model),
        preferences=preferences,
        generation=state.generation + 1,
        stopped=None,
    )


def _open_photo(state: AppState) -> Scene | None:
    """Return the open scene if it is a photo that was read whole, and nothing else was asked for."""
    scene = state.scene
    is_photo = scene is not None and scene.plan is not None and not scene.is_sketch and scene.source is state.source
    return scene if is_photo else None


def _is_elsewhere(model: str | None, models: DepthModels) -> bool:
    """Return whether a model must be downloaded first."""
    return any(offer.name == model and not offer.is_here for offer in models.known)
