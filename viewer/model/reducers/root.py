"""`reduce`: the only place where the state changes. Pure; what the outside world must do comes out as tasks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath
from typing import Any

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.lens_limits import clamp_optics, is_finite
from iibr_core.scenes.scene import DepthSettings, Progress
from viewer.model.action import Action as VerbAction
from viewer.model.actions import Action, OpenPath, RestoreSession, SetState, StopWork, TakeSettings, WorkerEvent
from viewer.model.carried_optics import with_focus_of
from viewer.model.history import record_edit
from viewer.model.messages import notify
from viewer.model.reducers.folder_reducer import list_folder, photo_after, scroll_filmstrip
from viewer.model.reducers.preferences_reducer import reduce_preferences
from viewer.model.reducers.worker_events import reduce_worker_event, stop_work
from viewer.model.state.app_state import AppState
from viewer.model.state.folder import FolderListed, ScrollFilmstrip, SetFolderOrder, StepPhoto
from viewer.model.state.notices import Notice
from viewer.model.state.preferences import PreferencesAction
from viewer.model.state.saving import SavedSettings
from viewer.model.state.viewpoint import Motion

AS_LEFT = "Restored as you left it. Ctrl+Z resets."


def reduce(state: AppState, action: Action) -> AppState:
    """The state after an action. Values that are not finite leave the state as it is, others are clamped."""
    if isinstance(action, VerbAction):
        return action.apply(state)
    if isinstance(action, WorkerEvent):
        return reduce_worker_event(state, action)
    if isinstance(action, PreferencesAction):
        return replace(state, preferences=reduce_preferences(state.preferences, action))
    match action:
        case TakeSettings(settings):
            return record_edit(state, _take_settings(state, settings), "TakeSettings")
        case RestoreSession(settings):
            return record_edit(state, _restore(state, settings), "RestoreSession")
        case SetState(field, value):
            change: dict[str, Any] = {field: value}
            return replace(state, **change)
    return _reduce_files(state, action)


def _reduce_files(state: AppState, action: Action) -> AppState:
    """What is opened, and what is to be done outside."""
    match action:
        case FolderListed(path, photos):
            return list_folder(state, path, photos)
        case StepPhoto(steps):
            return _step_photo(state, steps)
        case ScrollFilmstrip(photos_on):
            return scroll_filmstrip(state, photos_on)
        case SetFolderOrder(order):
            state = replace(state, preferences=replace(state.preferences, folder_order=order))
            return list_folder(state, state.folder.path, state.folder.photos) if state.folder is not None else state
        case OpenPath(source):
            progress = Progress(doing=f"reading {PurePath(source.path).name}")
            models = replace(state.models, asked=None, left_focus=None)
            state = replace(state, free_camera=None, prompt=None, models=models)
            return replace(state, source=source, progress=progress, generation=state.generation + 1)
        case StopWork():
            return stop_work(state)
    return state


def _step_photo(state: AppState, steps: int) -> AppState:
    source = photo_after(state, steps)
    if source is None or state.folder is None:
        return state
    name = PurePath(source.path).name
    folder = replace(state.folder, step=1 if steps > 0 else -1, stepped_to=name, scrolled=0)
    return _reduce_files(replace(state, folder=folder), OpenPath(source))


def _take_settings(state: AppState, settings: SavedSettings) -> AppState:
    """The optics, made to fit. What needs a new field, depth strength and all that is decided at opening, stays."""
    if state.scene is None or not is_finite(settings.optics):
        return state
    optics = clamp_optics(settings.optics_at(state.scene.width), state.scene)
    notices = tuple(notice for notice in state.notices if notice.offer != settings)
    return replace(state, optics=optics, notices=notices, motion=Motion(speed=state.motion.speed))


def _restore(state: AppState, settings: SavedSettings) -> AppState:
    """As the photo was left: the lens, and what was made of its depth."""
    restored = _take_settings(state, settings)
    if state.scene is None or restored is state:
        return state
    has_aperture = settings.optics.aperture_diameter > 0
    restored = replace(restored, chosen_focus=restored.optics.focus_disparity, has_chosen_aperture=has_aperture)
    if settings.has_model_depth and state.scene.is_guessed:  # the focus is of another depth than this
        models = replace(state.models, left_focus=settings.optics_at(state.scene.width))
        optics = with_focus_of(restored.optics, Optics())
        restored = replace(restored, optics=optics, chosen_focus=None, models=models)
    if state.scene.plan is None:
        return restored
    depth = DepthSettings(settings.source.depth.refine, settings.depth_edits)
    if (depth, settings.depth_strength) != (state.depth, state.depth_strength):
        restored = replace(restored, depth=depth, depth_strength=settings.depth_strength)
        restored = replace(restored, generation=state.generation + 1)
    return notify(restored, Notice(AS_LEFT))
