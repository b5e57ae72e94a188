"""From a guess to true depth: which model is to be asked for the open photo, and what each action about it changes."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.scenes.scene import Scene, source_with_depth
from viewer.model.state.app_state import AppState
from viewer.model.state.model_download import (
    DepthEstimated,
    DepthModels,
    DownloadingChanged,
    GetDepth,
    GetModelTask,
    GiveUpEstimate,
    ModelAction,
    ModelOffer,
    ModelsListed,
    ShowOffer,
    UseModel,
)


def wanted_model(state: AppState) -> str | None:
    """Name or path of the model that is to be asked now; None where none is, or the photo's depth is from it."""
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
    """What the notice beside a guess offers; None where there is no such notice."""
    scene, models = _open_photo(state), state.models
    if scene is None or not scene.is_guessed or scene.source.depth.start == "rough":
        return None
    is_busy = models.downloading is not None or wanted_model(state) is not None
    return None if is_busy or scene.source.path in models.dismissed else models.recommended


def reduce_models(state: AppState, action: ModelAction) -> AppState:
    """The state after an action about depth models."""
    models, scene = state.models, _open_photo(state)
    match action:
        case ModelsListed(known):
            return replace(state, models=replace(models, known=known))
        case DownloadingChanged(downloading):
            is_left = downloading is None and _is_elsewhere(models.asked, models)
            asked = None if is_left else models.asked
            return replace(state, models=replace(models, downloading=downloading, asked=asked))
        case GetDepth():
            return _get_depth(state)
    if scene is None:
        return state
    path = frozenset({scene.source.path})
    match action:
        case UseModel(model):
            return replace(state, models=replace(models, asked=model, given_up=models.given_up - path))
        case ShowOffer(is_shown):
            dismissed = models.dismissed - path if is_shown else models.dismissed | path
            return replace(state, models=replace(models, dismissed=dismissed))
        case GiveUpEstimate():
            return replace(state, models=replace(models, asked=None, given_up=models.given_up | path))
        case DepthEstimated(model):
            return _take_estimate(state, scene, model)
    return state


def _open_photo(state: AppState) -> Scene | None:
    """What is open, where that is a photo, all of it is read, and nothing else is asked for."""
    scene = state.scene
    is_photo = scene is not None and scene.plan is not None and not scene.is_sketch and scene.source is state.source
    return scene if is_photo else None


def _get_depth(state: AppState) -> AppState:
    """The click is the consent to all that follows."""
    offer, scene, models = state.models.recommended, _open_photo(state), state.models
    if offer is None or offer.lacks:
        return state
    state = replace(state, preferences=replace(state.preferences, estimates_depth=True))
    if scene is not None:
        asked = offer.name if not scene.is_guessed else models.asked
        models = replace(models, asked=asked, given_up=models.given_up - {scene.source.path})
    tasks = state.tasks if offer.is_here else (*state.tasks, GetModelTask(offer.name))
    return replace(state, models=models, tasks=tasks)


def _is_elsewhere(model: str | None, models: DepthModels) -> bool:
    """Whether it must be downloaded first."""
    return any(offer.name == model and not offer.is_here for offer in models.known)


def _take_estimate(state: AppState, scene: Scene, model: str) -> AppState:
    """Where the user chose the model, that is what the photo is opened with from now on."""
    models = state.models
    source = scene.source if models.asked is None else source_with_depth(scene.source, "model", model)
    return replace(
        state,
        source=source,
        scene=replace(scene, source=source, depth_model=model),
        models=replace(models, asked=None),
        generation=state.generation + 1,
        stopped=None,
    )
