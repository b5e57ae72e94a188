"""`apply`: the only place where the state changes. Pure; what the outside world must do comes out as tasks."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import PurePath

from viewer.model.actions import (
    Action,
    AskForPath,
    AskToSave,
    DismissNotice,
    DoTask,
    EndGesture,
    FocusOn,
    MotionEdit,
    MoveEye,
    Notify,
    OpenPath,
    OpticsEdit,
    PauseMotion,
    PictureDrawn,
    PlaceWindow,
    Quit,
    Redo,
    ResetOptics,
    ResumeWork,
    ReturnHome,
    SetDepthStrength,
    SetDolly,
    SetFontScale,
    SetHover,
    SetLoop,
    SetSpeed,
    SetTheme,
    SettingsEdit,
    ShowPrompt,
    ShowTiltHandles,
    StopWork,
    TakeSettings,
    TaskTaken,
    Tick,
    ToggleSection,
    Undo,
    WorkerLost,
    WorkerNews,
)
from viewer.model.lens.limits import (
    DEPTH_STRENGTH_LIMIT,
    FONT_SCALE_LIMITS,
    SPEED_LIMITS,
    clamped,
    clamped_optics,
    is_finite,
)
from viewer.model.reducers.camera_motion import begun, homeward, stepped
from viewer.model.reducers.depth_editing import depth_edited, stroke_ended
from viewer.model.reducers.history import gesture_ended, recorded, redone, undone
from viewer.model.reducers.inspection import divider_released, inspected, pointed_at
from viewer.model.reducers.lens import optics_edited
from viewer.model.reducers.worker_events import heard, noticed, stopped
from viewer.model.state.app_state import (
    SECTIONS,
    AppState,
    Motion,
    Notice,
    PathPrompt,
    Preferences,
    Progress,
    Saved,
    SavedSettings,
    SavePrompt,
    TiltHandles,
)
from viewer.model.state.depth_editing import DepthEdit
from viewer.model.state.inspection import InspectionEdit

LOST = "The worker stopped unexpectedly. Whatever you open or change next starts a new one."


def apply(state: AppState, action: Action) -> AppState:
    """The state after an action. Values that are not finite leave the state as it is, others are clamped."""
    if isinstance(action, OpticsEdit):
        moves = isinstance(action, MoveEye | SetDolly | ResetOptics)
        still = replace(state, motion=Motion(speed=state.motion.speed)) if moves else state
        edited = optics_edited(still, action)
        # ReturnHome takes the click back that it began with: so a click is remembered even where it changed nothing
        is_click = isinstance(action, FocusOn) and state.scene is not None
        return recorded(state, edited, type(action).__name__, always=is_click)
    if isinstance(action, MotionEdit):
        return _moved(state, action)
    if isinstance(action, WorkerNews):
        return heard(state, action)
    if isinstance(action, InspectionEdit):
        return inspected(state, action)
    if isinstance(action, DepthEdit):
        return depth_edited(state, action)
    if isinstance(action, SettingsEdit):
        return replace(state, preferences=_preferences_edited(state.preferences, action))
    match action:
        case SetDepthStrength():
            return recorded(state, _depth_strength_set(state, action), "SetDepthStrength")
        case TakeSettings(settings):
            return recorded(state, _settings_taken(state, settings), "TakeSettings")
        case EndGesture():
            return divider_released(gesture_ended(stroke_ended(state)))
        case Undo():
            return undone(state)
        case Redo():
            return redone(state)
        case Quit():
            return replace(state, should_quit=True)
    return _file_or_prompt(state, action)


def _file_or_prompt(state: AppState, action: Action) -> AppState:
    match action:
        case OpenPath(source):
            progress = Progress(doing=f"reading {source.path}")
            generation = state.generation + 1
            return replace(state, source=source, progress=progress, generation=generation, prompt=None)
        case StopWork():
            return stopped(state)
        case ResumeWork() if state.scene is not None:
            return replace(state, generation=state.generation + 1, stopped=None)
        case WorkerLost():
            return replace(noticed(state, Notice(LOST, is_error=True)), progress=Progress(), stopped=state.generation)
        case DoTask(task):
            return replace(state, tasks=(*state.tasks, task))
        case TaskTaken(task):
            return replace(state, tasks=tuple(other for other in state.tasks if other != task))
        case ShowPrompt(prompt):
            return replace(state, prompt=prompt)
        case AskForPath(what):
            return replace(state, prompt=PathPrompt(what))
        case AskToSave(what) if state.scene is not None and (what == "picture" or state.scene.plan is not None):
            size_px = state.scene.width, state.scene.height
            return replace(state, prompt=SavePrompt(_path_beside(state, what), size_px, what=what))
        case PictureDrawn(report):
            return replace(state, report=report)
        case SetHover(hover):
            return pointed_at(state, hover)
        case Notify(notice):
            return noticed(state, notice)
        case DismissNotice(notice):
            return replace(state, notices=tuple(other for other in state.notices if other != notice))
        case ShowTiltHandles(is_shown):
            return replace(state, tilt_handles=TiltHandles() if is_shown else None)
    return state


def _moved(state: AppState, action: MotionEdit) -> AppState:
    motion, scene = state.motion, state.scene
    if scene is None:
        return state
    match action:
        case ReturnHome():
            state = _without_click(state)
            gliding = replace(state, motion=homeward(motion, state.optics))
            return recorded(state, gliding, "ReturnHome", always=True)
        case SetLoop(kind):
            return recorded(state, replace(state, motion=begun(motion, kind, state.optics)), "SetLoop", always=True)
        case SetSpeed(speed) if math.isfinite(speed):
            return replace(state, motion=replace(motion, speed=clamped(speed, *SPEED_LIMITS)))
        case PauseMotion(is_paused):
            return replace(state, motion=replace(motion, is_paused=is_paused, ticked_s=None))
        case Tick(now_s):
            motion, optics = stepped(motion, state.optics, scene.grid, now_s)
            return replace(state, motion=motion, optics=clamped_optics(optics, scene))
    return state


def _without_click(state: AppState) -> AppState:
    """A double click is a click first, and that has set the focus: take it back."""
    history = state.history
    if history.last != "FocusOn" or not history.past:
        return state
    return replace(state, optics=history.past[-1].optics, history=replace(history, past=history.past[:-1], last=""))


def _depth_strength_set(state: AppState, action: SetDepthStrength) -> AppState:
    if not math.isfinite(action.strength):
        return state
    strength = clamped(action.strength, 0.0, DEPTH_STRENGTH_LIMIT)
    restarts = action.is_finished and state.source is not None
    return replace(state, depth_strength=strength, generation=state.generation + restarts)


def _settings_taken(state: AppState, settings: SavedSettings) -> AppState:
    """The optics, made to fit. What needs a new field, depth strength and all that is decided at opening, stays."""
    if state.scene is None or not is_finite(settings.optics):
        return state
    optics = clamped_optics(settings.optics, state.scene)
    notices = tuple(notice for notice in state.notices if notice.offer != settings)
    return replace(state, optics=optics, notices=notices, motion=Motion(speed=state.motion.speed))


def _preferences_edited(preferences: Preferences, action: SettingsEdit) -> Preferences:
    match action:
        case SetTheme(theme):
            return replace(preferences, theme=theme)
        case SetFontScale(scale) if math.isfinite(scale):
            return replace(preferences, font_scale=clamped(scale, *FONT_SCALE_LIMITS))
        case ToggleSection(section):
            is_open = preferences.open_sections
            return replace(preferences, open_sections=tuple(s for s in SECTIONS if (s in is_open) != (s == section)))
        case PlaceWindow(place):
            return replace(preferences, window=place)
    return preferences


def _path_beside(state: AppState, what: Saved) -> str:
    """Where it is saved unless the user says otherwise: beside the photo. A map is found there the next time, unless
    one was given for it.
    """
    assert state.source is not None
    assert state.scene is not None
    path, origin = PurePath(state.source.path), state.scene.depth_origin
    ending = "-iibr.png" if what == "picture" else "_disparity.pfm"
    if what == "map" and origin is not None and origin.kind == "file":
        ending = "-edited.pfm"
    return str(path.parent / f"{state.scene.name}{ending}")
