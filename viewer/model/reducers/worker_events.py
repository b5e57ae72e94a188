"""What the worker says, by generation: late words of an earlier job change nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import PurePath

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.lens_limits import clamp_optics, focus_limits
from iibr_core.scenes.scene import DepthSettings, Progress, Scene
from iibr_core.types import InputError
from viewer.model.actions import NewDepth, OpenFailed, ProgressMade, SceneOpened, WorkerEvent
from viewer.model.carried_optics import carry_optics, carry_to_depth, with_focus_of
from viewer.model.history import map_optics
from viewer.model.messages import MAX_NOTICES, notify
from viewer.model.reducers.folder_reducer import is_stepped_to
from viewer.model.remedies import DEPTH_COMMANDS
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import ListModelsTask
from viewer.model.state.folder import ListFolderTask
from viewer.model.state.history import History
from viewer.model.state.notices import Notice
from viewer.model.state.photo_facts import ReadFactsTask
from viewer.model.state.viewpoint import Motion

RECENT_KEPT = 8


def reduce_worker_event(state: AppState, news: WorkerEvent) -> AppState:
    """The state after a word of the worker."""
    if news.generation != state.generation:
        return state
    match news:
        case SceneOpened(_, scene, new_depth):
            return _open_scene(state, scene, new_depth)
        case ProgressMade(_, progress, view):
            there = state.views_there if view is None else state.views_there | {view}
            shown = state.progress if state.stopped == state.generation else progress
            return replace(state, progress=shown, views_there=there)
        case OpenFailed(_, message):
            asks_for_model = state.source is not None and state.source.depth.asks_for_model
            commands = DEPTH_COMMANDS if asks_for_model else ()
            return _fail_to_open(notify(state, Notice(message, is_error=True, commands=commands)))


def stop_work(state: AppState) -> AppState:
    """The state when the user stops the work: the views made so far stay; what was only being read is left."""
    progress = state.progress
    is_reading = state.scene is None or state.scene.source is not state.source
    if is_reading and state.source is not None:
        left = _leave_job(state)
        is_back = left.scene is not None and left.scene.source is left.source
        return left if is_back else replace(left, stopped=state.generation, source=None)
    if state.scene is not None and state.scene.is_sketch:
        return replace(state, stopped=state.generation, progress=Progress(doing="stopped: this is a small preview"))
    if not progress.total or progress.is_complete:
        return state
    doing = f"stopped at {progress.done} of {progress.total} views"
    if progress.doing:
        doing = f"stopped {progress.doing}"
    return replace(state, stopped=state.generation, progress=Progress(doing=doing))


def _open_scene(state: AppState, scene: Scene, new_depth: NewDepth | None) -> AppState:
    old = state.scene
    if old is not None and old.source is scene.source and scene.plan is None:
        scene = _with_steady_focus(state, old, scene)

    def carried(optics: Optics) -> Optics:
        if new_depth is None or old is None:
            return carry_optics(optics, old, scene)
        return carry_to_depth(optics, old, scene, new_depth, state.focused_at)

    opened = replace(
        state,
        scene=scene,
        progress=_progress_of(state, scene),
        views_there=frozenset({scene.grid.centre}),
        shown_generation=state.generation,
        optics=carried(state.optics),
        chosen_focus=_carried_focus(state, carried),
        history=map_optics(state.history, carried),
        inspection=replace(state.inspection, probe=None),
    )
    notices = (*_problems(scene), *_offers(scene))[-MAX_NOTICES:]
    if old is not None and old.source is scene.source:
        is_whole_now = old.is_sketch and not scene.is_sketch
        opened = _with_left_focus(opened) if new_depth is not None else opened
        return replace(opened, notices=(*state.notices, *notices)[-MAX_NOTICES:]) if is_whole_now else opened
    # the same file, opened again, is new
    motion = Motion(speed=state.motion.speed)
    recent = state.recent
    if old is not None and is_stepped_to(state.folder, scene.source):
        recent = tuple(path for path in recent if path != old.source.path)  # or a walk would be all that is left there
    recent = remember_recent(recent, scene.source.path)
    inspection = state.inspection.for_next_scene
    opened = replace(opened, tilt_handles=None, hover=None, inspection=inspection, zoom=None)
    depth = DepthSettings(scene.source.depth.refine)
    if scene.plan is not None:  # a photo: it may have neighbours
        folder = str(PurePath(scene.source.path).parent)
        beside = ListFolderTask(folder), ReadFactsTask(scene.source.path), ListModelsTask()
        opened = replace(opened, tasks=(*opened.tasks, *beside))
    return replace(
        opened,
        notices=(*(notice for notice in state.notices if notice.stays), *notices)[-MAX_NOTICES:],
        history=History(),
        motion=motion,
        recent=recent,
        depth=depth,
        stroke=None,
        brush=replace(state.brush, sample=None),
        chosen_focus=None,
        has_chosen_aperture=False,
        focused_at=None,
    )


def _carried_focus(state: AppState, carried: Callable[[Optics], Optics]) -> float | None:
    """Return the chosen focus in the disparity of the new scene."""
    if state.chosen_focus is None:
        return None
    return carried(replace(state.optics, focus_disparity=state.chosen_focus, focus_tilt=(0.0, 0.0))).focus_disparity


def _with_steady_focus(state: AppState, old: Scene, scene: Scene) -> Scene:
    """A light field of which more is known now: the control of its focus does not move by itself. The limits stay where
    they hold what was found, and they hold the focus that the user chose.
    """
    (low, high), (least, most) = scene.disparity_range_px, focus_limits(old)
    if old.has_view_disparity and least <= low <= high <= most:
        return replace(scene, disparity_range_px=old.disparity_range_px)
    if state.chosen_focus is None:
        return scene
    focus = state.optics.focus_disparity
    return replace(scene, disparity_range_px=(min(low, focus), max(high, focus)))


def _with_left_focus(state: AppState) -> AppState:
    """With the depth that the photo was left with, and the focus, unless the user chose another meanwhile."""
    left = state.models.left_focus
    if left is None or state.chosen_focus is not None or state.scene is None:
        return state
    optics = clamp_optics(with_focus_of(state.optics, left), state.scene)
    return replace(
        state, optics=optics, chosen_focus=optics.focus_disparity, models=replace(state.models, left_focus=None)
    )


def _progress_of(state: AppState, scene: Scene) -> Progress:
    """What is shown until more is heard: of a light field, which is shown more than once, how far its job was."""
    if scene.plan is None and state.progress.share > 0 and not state.progress.is_complete:
        return state.progress
    return Progress(doing=f"reading {scene.name}" if scene.is_sketch else "making views")


def remember_recent(recent: tuple[str, ...], path: str) -> tuple[str, ...]:
    """The recent paths with this one first."""
    return (path, *(other for other in recent if other != path))[:RECENT_KEPT]


def _problems(scene: Scene) -> tuple[Notice, ...]:
    """Return a notice for each source of depth that failed, with buttons that give better depth if it is poor."""
    is_poor = scene.depth_origin is not None and scene.depth_origin.is_poor
    return tuple(Notice(problem, commands=DEPTH_COMMANDS if is_poor else ()) for problem in scene.problems)


def _offers(scene: Scene) -> tuple[Notice, ...]:
    """A picture saved by this program brings its settings."""
    if not scene.settings:
        return ()
    from viewer.model.saved_settings import left_out_note, settings_from_text

    try:
        settings = settings_from_text(scene.settings, scene.name)
    except InputError as error:
        return (Notice(str(error), is_error=True),)
    words = f"This picture was saved by iibr, with its settings. {left_out_note(settings)}"
    return (Notice(words.strip(), offer=settings),)


def _fail_to_open(state: AppState) -> AppState:
    """The state after a file did not open. A photo that was stepped to is passed by from now on; where nothing else is
    open, one may go on to those beside it.
    """
    folder, source, scene = state.folder, state.source, state.scene
    if source is None or (scene is not None and scene.source is source):
        return _leave_job(state)
    if scene is None:
        state = replace(state, tasks=(*state.tasks, ListFolderTask(str(PurePath(source.path).parent))))
    elif folder is not None and is_stepped_to(folder, source):
        state = replace(state, folder=replace(folder, unreadable=folder.unreadable | {folder.stepped_to}))
    return _leave_job(state)


def _leave_job(state: AppState) -> AppState:
    """Return the state without this job; where another scene is open, its views are made again."""
    state = replace(state, progress=Progress())
    if state.scene is None or state.scene.source is state.source:
        return state
    return replace(state, source=state.scene.source, generation=state.generation + 1)
