"""`reduce`: the only place where the state changes. Pure; what the outside world must do comes out as tasks."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import PurePath
from typing import Any

from iibr_core.beyond.optics import Optics
from iibr_core.gloss.settings import STROKE_RADIUS_LIMITS
from iibr_core.scenes.lens_limits import clamp, clamp_optics, is_finite
from iibr_core.scenes.scene import DepthSettings, Progress
from viewer.model.action import Action as VerbAction
from viewer.model.actions import (
    Action,
    EndGesture,
    OpenPath,
    Redo,
    RestoreSession,
    SetDepthStrength,
    SetState,
    ShowBefore,
    ShowTiltHandles,
    StopWork,
    TakeSettings,
    Undo,
    WorkerEvent,
)
from viewer.model.free_camera import FreeCameraAction
from viewer.model.inspection import release_divider
from viewer.model.messages import notify
from viewer.model.reducers.depth_editing_reducer import end_stroke, reduce_depth
from viewer.model.reducers.depth_models import reduce_models
from viewer.model.reducers.folder_reducer import list_folder, photo_after, scroll_filmstrip
from viewer.model.reducers.free_camera_reducer import reduce_free_camera
from viewer.model.reducers.history_reducer import end_gesture, record_edit, redo, undo
from viewer.model.reducers.lens_reducer import reduce_lens, with_focus_of
from viewer.model.reducers.motion_reducer import reduce_motion
from viewer.model.reducers.preferences_reducer import reduce_preferences
from viewer.model.reducers.worker_events import reduce_worker_event, stop_work
from viewer.model.state.app_state import AppState, TiltHandles
from viewer.model.state.depth_editing import DepthAction
from viewer.model.state.folder import FolderListed, ScrollFilmstrip, SetFolderOrder, StepPhoto
from viewer.model.state.model_download import ModelAction
from viewer.model.state.motion import Motion, MotionAction
from viewer.model.state.notices import Notice
from viewer.model.state.optics_actions import (
    FocusOn,
    GlossBrush,
    LensAction,
    MoveEye,
    ResetOptics,
    SetGlossBrush,
    SetOptics,
)
from viewer.model.state.preferences import PreferencesAction
from viewer.model.state.saving import SavedSettings
from viewer.model.window_limits import DEPTH_STRENGTH_LIMIT
from viewer.model.zoom import LEAST_ZOOM, SetZoom, Zoom

AS_LEFT = "Restored as you left it. Ctrl+Z resets."


def reduce(state: AppState, action: Action) -> AppState:
    """The state after an action. Values that are not finite leave the state as it is, others are clamped."""
    if isinstance(action, VerbAction):
        return action.apply(state)
    if isinstance(action, LensAction):
        state = replace(state, shows_before=False) if state.shows_before else state
        state = replace(state, free_camera=None) if isinstance(action, ResetOptics) else state
        kind = action.field if isinstance(action, SetOptics) else type(action).__name__
        moves = isinstance(action, MoveEye | ResetOptics) or kind == "dolly"
        still = replace(state, motion=Motion(speed=state.motion.speed)) if moves else state
        edited = reduce_lens(still, action)
        # ReturnHome takes the click back that it began with: so a click is remembered even where it changed nothing
        is_click = isinstance(action, FocusOn) and state.scene is not None
        return record_edit(state, edited, kind, always=is_click)
    if isinstance(action, MotionAction):
        return reduce_motion(state, action)
    if isinstance(action, FreeCameraAction):
        return reduce_free_camera(state, action)
    if isinstance(action, WorkerEvent):
        return reduce_worker_event(state, action)
    if isinstance(action, DepthAction):
        return reduce_depth(state, action)
    if isinstance(action, ModelAction):
        return reduce_models(state, action)
    if isinstance(action, PreferencesAction):
        return replace(state, preferences=reduce_preferences(state.preferences, action))
    match action:
        case SetDepthStrength():
            return record_edit(state, _set_depth_strength(state, action), "SetDepthStrength")
        case TakeSettings(settings):
            return record_edit(state, _take_settings(state, settings), "TakeSettings")
        case RestoreSession(settings):
            return record_edit(state, _restore(state, settings), "RestoreSession")
        case SetState(field, value):
            change: dict[str, Any] = {field: value}
            return replace(state, **change)
        case EndGesture():
            return release_divider(end_gesture(end_stroke(state)))
        case Undo():
            return undo(state)
        case Redo():
            return redo(state)
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
    return _reduce_screen(state, action)


def _reduce_screen(state: AppState, action: Action) -> AppState:
    """What stands on the screen beside the picture: prompts, notices, progress, and where one looks."""
    match action:
        case SetGlossBrush(brush):
            return _take_gloss_brush(state, brush)
        case ShowBefore(is_shown):
            return replace(state, shows_before=is_shown and state.scene is not None)
        case SetZoom(zoom):
            return replace(state, zoom=_checked_zoom(zoom) if state.scene is not None else None)
        case ShowTiltHandles(is_shown):
            return replace(state, tilt_handles=TiltHandles() if is_shown else None)
    return state


def _take_gloss_brush(state: AppState, brush: GlossBrush) -> AppState:
    """Take the gloss brush and put the depth brush away: at most one is in hand."""
    depth_brush = replace(state.brush, is_on=state.brush.is_on and not brush.is_on)
    taken = replace(brush, radius=clamp(brush.radius, *STROKE_RADIUS_LIMITS))
    return replace(state, gloss_brush=taken, brush=depth_brush)


def _checked_zoom(zoom: Zoom | None) -> Zoom | None:
    """One that shows something of the picture; None where it says nothing."""
    if zoom is None or not all(map(math.isfinite, (zoom.scale, *zoom.centre))):
        return None
    x, y = (clamp(at, 0.0, 1.0) for at in zoom.centre)
    return Zoom(max(zoom.scale, LEAST_ZOOM), (x, y))


def _step_photo(state: AppState, steps: int) -> AppState:
    source = photo_after(state, steps)
    if source is None or state.folder is None:
        return state
    name = PurePath(source.path).name
    folder = replace(state.folder, step=1 if steps > 0 else -1, stepped_to=name, scrolled=0)
    return _reduce_files(replace(state, folder=folder), OpenPath(source))


def _set_depth_strength(state: AppState, action: SetDepthStrength) -> AppState:
    if not math.isfinite(action.strength):
        return state
    strength = clamp(action.strength, 0.0, DEPTH_STRENGTH_LIMIT)
    restarts = action.is_finished and state.source is not None
    generation = state.generation + 1 if restarts else state.generation
    return replace(state, depth_strength=strength, generation=generation)


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
    restored = replace(restored, has_chosen_focus=True, has_chosen_aperture=has_aperture)
    if settings.has_model_depth and state.scene.is_guessed:  # the focus is of another depth than this
        models = replace(state.models, left_focus=settings.optics_at(state.scene.width))
        optics = with_focus_of(restored.optics, Optics())
        restored = replace(restored, optics=optics, has_chosen_focus=False, models=models)
    if state.scene.plan is None:
        return restored
    depth = DepthSettings(settings.source.depth.refine, settings.depth_edits)
    if (depth, settings.depth_strength) != (state.depth, state.depth_strength):
        restored = replace(restored, depth=depth, depth_strength=settings.depth_strength)
        restored = replace(restored, generation=state.generation + 1)
    return notify(restored, Notice(AS_LEFT))
