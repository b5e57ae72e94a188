"""Depth by a model: which model the open photo needs, and the verbs about models."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.scenes.scene import Scene, source_with_depth
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import DepthModels, Downloading, ModelOffer
from viewer.model.state.tasks import PlainTask


def wanted_model(state: AppState) -> str | None:
    """Return the name or path of the model that is to estimate depth now; None if no model is."""
    scene, models = _open_photo(state), state.models
    if scene is None or scene.source.path in models.given_up:
        return None
    choice, usual = scene.source.depth, models.recommended
    wanted = models.asked or (choice.model if choice.asks_for_model else None)
    if _is_elsewhere(wanted, models):
        return None
    if wanted is None and usual is not None and usual.is_ready:
        is_unasked = scene.is_guessed and choice.start in ("auto", "embedded") and state.preferences.estimates_depth
        wanted = usual.name if is_unasked or choice.start == "model" else None
    return wanted if wanted != scene.depth_model else None


def offered_model(state: AppState) -> ModelOffer | None:
    """Return the model that is offered for guessed depth; None if there is no offer."""
    scene, models = _open_photo(state), state.models
    if scene is None or not scene.is_guessed or scene.source.depth.start == "rough":
        return None
    is_busy = models.downloading is not None or wanted_model(state) is not None
    return None if is_busy or scene.source.path in models.dismissed else models.recommended


def set_known(state: AppState, known: tuple[ModelOffer, ...]) -> AppState:
    """Set the models that can be had."""
    return replace(state, models=replace(state.models, known=known))


def set_downloading(state: AppState, downloading: Downloading | None) -> AppState:
    """Set the download under way; None: there is none, and a model that did not come is wanted no more."""
    models = state.models
    is_given_up = downloading is None and _is_elsewhere(models.asked, models)
    asked = None if is_given_up else models.asked
    return replace(state, models=replace(models, downloading=downloading, asked=asked))


def get_depth(state: AppState) -> AppState:
    """Estimate depth with the recommended model, downloaded if needed, for this photo and all further photos."""
    offer, scene, models = state.models.recommended, _open_photo(state), state.models
    if offer is None or offer.lacks:
        return state
    state = replace(state, preferences=replace(state.preferences, estimates_depth=True))
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
    if models.recommended is not None and model == models.recommended.name and not models.recommended.is_here:
        return get_depth(state)
    state = replace(state, models=replace(models, asked=model, given_up=models.given_up - {scene.source.path}))
    return state.with_tasks(PlainTask("download model", model)) if _is_elsewhere(model, models) else state


def show_offer(state: AppState, is_shown: bool) -> AppState:
    """Offer the recommended model for the open photo, or close the offer for this run."""
    scene, models = _open_photo(state), state.models
    if scene is None:
        return state
    path = frozenset({scene.source.path})
    return replace(
        state, models=replace(models, dismissed=models.dismissed - path if is_shown else models.dismissed | path)
    )


def give_up(state: AppState) -> AppState:
    """Keep the depth that the open photo has, and close the offer of a model."""
    scene, models = _open_photo(state), state.models
    if scene is None:
        return state
    given_up, dismissed = (paths | {scene.source.path} for paths in (models.given_up, models.dismissed))
    return replace(state, models=replace(models, asked=None, given_up=given_up, dismissed=dismissed))


def take_estimate(state: AppState, model: str) -> AppState:
    """Make the views again from the depth that this model estimated. A model that was chosen stays the photo's own."""
    scene, models = _open_photo(state), state.models
    if scene is None:
        return state
    source = scene.source if models.asked is None else source_with_depth(scene.source, "model", model)
    return replace(
        state,
        source=source,
        scene=replace(scene, source=source, depth_model=model),
        models=replace(models, asked=None),
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
