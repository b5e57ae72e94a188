"""What the user and the worker can do to the state: typed actions, and `apply`, the only place where it changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from iibr_core.types import GridShape, ViewOffset
from viewer.state import AppState, Notice, Optics, Progress, Scene, Source

EYE_MARGIN_VIEWS = 0.5
"""How far the viewpoint may leave the grid of views."""

EXPOSURE_LIMIT_STOPS = 6.0
DEPTH_STRENGTH_LIMIT = 4.0
NOTICES_KEPT = 5


@dataclass(frozen=True)
class MoveEye:
    """Put the viewpoint at this view offset (clamped to the grid and a little beyond)."""

    eye: ViewOffset


@dataclass(frozen=True)
class SetFocus:
    """Focus on this field disparity (px per view step)."""

    disparity: float


@dataclass(frozen=True)
class SetAperture:
    """Open the aperture to this diameter in view steps."""

    diameter: float


@dataclass(frozen=True)
class SetExposure:
    """Brighten the picture by this many stops."""

    stops: float


@dataclass(frozen=True)
class SetDepthStrength:
    """Multiply the planned parallax; the field is generated anew once the edit is finished."""

    strength: float
    is_finished: bool


@dataclass(frozen=True)
class ResetOptics:
    """Back to the centre viewpoint, the planned focus plane, a pinhole and the photo's exposure."""


@dataclass(frozen=True)
class OpenPath:
    """Open a photo or a light-field folder instead of the present scene."""

    source: Source


@dataclass(frozen=True)
class SceneOpened:
    """The worker has read and planned the scene of this generation; its views follow."""

    generation: int
    scene: Scene


@dataclass(frozen=True)
class ProgressMade:
    """The worker of this generation came further."""

    generation: int
    progress: Progress


@dataclass(frozen=True)
class OpenFailed:
    """The worker of this generation gave up; the message says why."""

    generation: int
    message: str


@dataclass(frozen=True)
class Notify:
    """Show a notice."""

    notice: Notice


@dataclass(frozen=True)
class DismissNotice:
    """Take this notice away."""

    notice: Notice


@dataclass(frozen=True)
class Quit:
    """Close the window."""


Action = (
    MoveEye
    | SetFocus
    | SetAperture
    | SetExposure
    | SetDepthStrength
    | ResetOptics
    | OpenPath
    | SceneOpened
    | ProgressMade
    | OpenFailed
    | Notify
    | DismissNotice
    | Quit
)


def apply(state: AppState, action: Action) -> AppState:
    """The state after an action. Pure; values that are not finite leave the state as it is, others are clamped."""
    match action:
        case MoveEye() | SetFocus() | SetAperture() | SetExposure() | ResetOptics():
            return replace(state, optics=_edited_optics(state.optics, state.scene, action))
        case SetDepthStrength():
            return _depth_strength_set(state, action)
        case OpenPath(source):
            progress = Progress(doing=f"reading {source.path}")
            return replace(state, source=source, progress=progress, generation=state.generation + 1)
        case SceneOpened(generation) | ProgressMade(generation) | OpenFailed(generation):
            return _heard_from_worker(state, action) if generation == state.generation else state
        case Notify(notice):
            return _noticed(state, notice)
        case DismissNotice(notice):
            return replace(state, notices=tuple(other for other in state.notices if other != notice))
        case Quit():
            return replace(state, should_quit=True)


def clamped_eye(eye: ViewOffset, grid: GridShape) -> ViewOffset:
    """The nearest viewpoint within the grid and `EYE_MARGIN_VIEWS` beyond it."""
    row, column = grid.centre
    t = _clamped(eye.t, -row - EYE_MARGIN_VIEWS, grid.rows - 1 - row + EYE_MARGIN_VIEWS)
    s = _clamped(eye.s, -column - EYE_MARGIN_VIEWS, grid.columns - 1 - column + EYE_MARGIN_VIEWS)
    return ViewOffset(t, s)


def focus_limits(scene: Scene) -> tuple[float, float]:
    """Least and greatest focus disparity worth setting: the scene's range and a tenth more on both sides."""
    near_and_far = (*scene.disparity_range_px, 0.0)
    margin = 0.1 * (max(near_and_far) - min(near_and_far)) or 0.1
    return min(near_and_far) - margin, max(near_and_far) + margin


def aperture_limit(grid: GridShape) -> float:
    """The widest aperture in view steps: the whole grid; 0 where there is a single view."""
    return float(max(grid) if max(grid) > 1 else 0)


def _edited_optics(optics: Optics, scene: Scene | None, action: Action) -> Optics:
    if scene is None:
        return optics
    match action:
        case MoveEye(eye) if all(map(math.isfinite, eye)):
            return replace(optics, eye=clamped_eye(eye, scene.grid))
        case SetFocus(disparity) if math.isfinite(disparity):
            return replace(optics, focus_disparity=_clamped(disparity, *focus_limits(scene)))
        case SetAperture(diameter) if math.isfinite(diameter):
            return replace(optics, aperture_diameter=_clamped(diameter, 0.0, aperture_limit(scene.grid)))
        case SetExposure(stops) if math.isfinite(stops):
            return replace(optics, exposure_stops=_clamped(stops, -EXPOSURE_LIMIT_STOPS, EXPOSURE_LIMIT_STOPS))
        case ResetOptics():
            return Optics()
    return optics


def _depth_strength_set(state: AppState, action: SetDepthStrength) -> AppState:
    if not math.isfinite(action.strength):
        return state
    strength = _clamped(action.strength, 0.0, DEPTH_STRENGTH_LIMIT)
    restarts = action.is_finished and state.source is not None
    return replace(state, depth_strength=strength, generation=state.generation + restarts)


def _heard_from_worker(state: AppState, action: Action) -> AppState:
    match action:
        case SceneOpened(_, scene):
            is_new = (
                state.scene is None or state.scene.source is not scene.source
            )  # the same file, opened again, is new
            notices = tuple(Notice(note) for note in scene.notes)[-NOTICES_KEPT:] if is_new else state.notices
            optics = _carried_optics(state.optics, state.scene, scene)
            progress = Progress(doing="making views")
            return replace(state, scene=scene, optics=optics, notices=notices, progress=progress)
        case ProgressMade(_, progress):
            return replace(state, progress=progress)
        case OpenFailed(_, message):
            return _failed(state, message)
    return state


def _failed(state: AppState, message: str) -> AppState:
    """Say why. Where another scene was open before, the program returns to it: its views may not all have been made."""
    state = replace(_noticed(state, Notice(message, is_error=True)), progress=Progress())
    if state.scene is None or state.scene.source is state.source:
        return state
    return replace(state, source=state.scene.source, generation=state.generation + 1)


def _clamped(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def _noticed(state: AppState, notice: Notice) -> AppState:
    others = tuple(other for other in state.notices if other != notice)
    return replace(state, notices=(*others, notice)[-NOTICES_KEPT:])


def _carried_optics(optics: Optics, old: Scene | None, new: Scene) -> Optics:
    """The optics that show a newly planned scene as it was seen before; a scene not seen before starts afresh."""
    if old is None or old.source is not new.source or old.plan is None or new.plan is None:
        return Optics()
    eye = ViewOffset(*(x * _steps(b) / _steps(a) for x, a, b in zip(optics.eye, old.grid, new.grid)))
    ratio = new.plan.disparity_scale / old.plan.disparity_scale if old.plan.disparity_scale else 0.0
    # (given - zero) * scale, for the given disparity that was in focus
    focus = (
        optics.focus_disparity * ratio + (old.plan.disparity_zero - new.plan.disparity_zero) * new.plan.disparity_scale
    )
    aperture = min(optics.aperture_diameter * _steps(new.grid[0]) / _steps(old.grid[0]), aperture_limit(new.grid))
    return replace(optics, eye=clamped_eye(eye, new.grid), focus_disparity=focus, aperture_diameter=aperture)


def _steps(views: int) -> int:
    return max(views - 1, 1)
