"""Verbs about opening: a source is asked for, read, shown, and its views arrive; or it fails, or is stopped.

Each request has a generation. Results of an earlier generation change nothing.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import PurePath

from iibr_core.beyond.optics import Optics
from iibr_core.formats.images.picture import CUT_OFF
from iibr_core.formats.maps.map_names import is_map_path
from iibr_core.scenes.lens_limits import clamp_optics, focus_limits, is_finite
from iibr_core.scenes.scene import (
    DepthSettings,
    Progress,
    Scene,
    Source,
    source_beside,
    source_with_depth,
    source_with_map,
)
from iibr_core.types import InputError
from viewer.model.action import Setter, setter
from viewer.model.app_state import AppState
from viewer.model.carried_optics import NewDepth, carry_optics, carry_to_depth, with_focus_of
from viewer.model.demo_photo import is_ours
from viewer.model.depth_models import keep_choice, offered_model
from viewer.model.focal_plane import focus_on
from viewer.model.history import History, map_optics, undoable
from viewer.model.messages import MAX_NOTICES, Notice, notify
from viewer.model.remedies import DEPTH_COMMANDS
from viewer.model.saving import SavedSettings
from viewer.model.tasks import FocusTask, PlainTask

MAX_RECENT = 8
RESTORED = "Restored as you left it. Ctrl+Z resets."


def open_source(state: AppState, source: Source) -> AppState:
    """Open a photo or a light field in place of the open scene, which stays until the new one is read."""
    offered_for = state.models.offered_for if offered_model(state) is None else ""
    return replace(
        keep_choice(state, source),
        source=source,
        progress=Progress(doing=f"reading {PurePath(source.path).name}"),
        generation=state.generation + 1,
        models=replace(state.models, asked=None, left_focus=None, offered_for=offered_for),
        free_camera=None,
        prompt=None,
    )


def open_paths(state: AppState, paths: Sequence[str]) -> AppState:
    """Open the first photo of some paths, with a depth map among them; a map alone is for the photo that is open."""
    maps = [path for path in paths if is_map_path(PurePath(path))]
    others = [path for path in paths if path not in maps]
    source = source_beside(state.source, others[0]) if others else state.source
    if source is not None and maps:
        return open_source(state, source_with_map(source, maps[0]))
    return open_source(state, source or Source(maps[0])) if others or maps else state


def stop(state: AppState) -> AppState:
    """Stop the work: views made so far stay; a source that was only being read is not opened."""
    progress, source = state.progress, state.source
    if source is not None and (state.scene is None or state.scene.source is not source):
        before = _leave_source(state)
        return before if state.scene is not None else replace(before, stopped=state.generation, source=None)
    if state.scene is not None and state.scene.is_sketch:
        return replace(state, stopped=state.generation, progress=Progress(doing="stopped: this is a small preview"))
    if not progress.total or progress.is_complete:
        return state
    doing = progress.doing or f"at {progress.done} of {progress.total} views"
    return replace(state, stopped=state.generation, progress=Progress(doing=f"stopped {doing}"))


def set_progress(state: AppState, generation: int, progress: Progress, view: tuple[int, int] | None = None) -> AppState:
    """Show how far the work is. view: row and column of the view that was just made."""
    if generation != state.generation:
        return state
    there = state.views_there if view is None else state.views_there | {view}
    shown = state.progress if state.stopped == state.generation else progress
    return replace(state, progress=shown, views_there=there)


def report_failure(state: AppState, generation: int, message: str) -> AppState:
    """Show why a source did not open, and return to the open scene. Steps pass such a photo by."""
    if generation != state.generation:
        return state
    source, folder = state.source, state.folder
    asks_for_model = source is not None and source.depth.asks_for_model
    state = notify(state, Notice(message, is_error=True, commands=DEPTH_COMMANDS if asks_for_model else ()))
    if source is not None and state.scene is None:  # one may go on to the photos beside it
        state = state.with_tasks(PlainTask("list folder", str(PurePath(source.path).parent)))
    elif source is not None and folder is not None and folder.is_stepped_to(source):
        state = replace(state, folder=replace(folder, unreadable=folder.unreadable | {folder.stepped_to}))
    return _leave_source(state)


def show_scene(state: AppState, generation: int, scene: Scene, new_depth: NewDepth | None = None) -> AppState:
    """Show a scene that was read and planned. new_depth: of the open photo, if it has other depth now."""
    if generation != state.generation:
        return state
    old = state.scene
    is_same = old is not None and old.source is scene.source  # the same file, opened again, is new
    if old is not None and is_same and scene.plan is None:
        scene = _with_steady_focus(state, old, scene)

    def carried(optics: Optics, limits_aperture: bool = True) -> Optics:
        if new_depth is None or old is None:
            return carry_optics(optics, old, scene, limits_aperture)
        return carry_to_depth(optics, old, scene, new_depth, state.focused_at, limits_aperture)

    shown = replace(
        state,
        scene=scene,
        progress=_first_progress(state, scene),
        views_there=frozenset({scene.grid.centre}),
        stereo=state.stereo if is_same else replace(state.stereo, eyes=None, screen=0.0),
        shown_generation=state.generation,
        optics=carried(state.optics),
        history=map_optics(state.history, partial(carried, limits_aperture=False)),
        chosen_focus=_carried_focus(state.chosen_focus, state.optics, carried),
        focus_before=_carried_focus(state.focus_before, state.optics, carried),
        inspection=replace(state.inspection, probe=None),
        restoring=None,
    )
    if old is None or not is_same:
        shown = _begin_scene(shown, old, scene)
    else:
        shown = _with_restored_optics(shown, state, scene)
        shown = shown if new_depth is None else _with_left_focus(shown)
        shown = _add_notices(shown, scene) if old.is_sketch and not scene.is_sketch else shown
    return shown


@undoable
def take_settings(state: AppState, scene: Scene, settings: SavedSettings) -> AppState:
    """Take over the optics that a picture was saved with, made to fit the open scene."""
    return _with_settings(state, scene, settings)


@undoable
def restore_session(state: AppState, scene: Scene, settings: SavedSettings, lost: str = "") -> AppState:
    """Restore what the open photo was left with: the lens, the depth edits, the depth strength, and its depth model.

    lost: reason why the model cannot be used, "" if it can. The place in focus then stays sharp at its depth now.
    """
    restored = _with_settings(state, scene, settings)
    if restored is state:
        return state
    has_aperture = settings.optics.aperture_diameter > 0
    restored = replace(restored, chosen_focus=restored.optics.focus_disparity, has_chosen_aperture=has_aperture)
    restored = replace(restored, focused_at=settings.focused_at)
    has_other_depth = settings.depth_model not in ("", scene.depth_model)
    has_other_depth |= settings.has_model_depth and scene.is_guessed
    if has_other_depth:  # the focus belongs to another depth
        optics = with_focus_of(restored.optics, Optics())
        restored = replace(restored, optics=optics, chosen_focus=None)
        if lost and settings.focused_at is not None:
            restored = restored.with_tasks(FocusTask(settings.focused_at))
        elif not lost:
            restored = _with_depth_model(restored, scene, settings)
    if scene.plan is None:
        return restored
    depth = DepthSettings(settings.source.depth.refine, settings.depth_edits)
    if (depth, settings.depth_strength) != (state.depth, state.depth_strength):
        left = settings.optics_at(scene.width)
        left = with_focus_of(left, Optics()) if has_other_depth else left
        restored = replace(restored, depth=depth, depth_strength=settings.depth_strength)
        restored = replace(restored, restoring=(restored.optics, left))
        restored = replace(restored, generation=state.generation + 1)
    words = f"Restored as you left it, except for its depth: {lost}." if lost else RESTORED
    return notify(restored, Notice(words, commands=DEPTH_COMMANDS if lost else ()))


def _with_depth_model(state: AppState, scene: Scene, settings: SavedSettings) -> AppState:
    """Return the state in which the session's model is to estimate depth, and the session's focus waits for that."""
    source = scene.source
    if settings.depth_model:
        start = source.depth.start if scene.is_guessed else "model"
        source = source_with_depth(source, start, settings.depth_model)
    models = replace(state.models, left_focus=settings.optics_at(scene.width))
    return replace(state, source=source, scene=replace(scene, source=source), models=models)


def focus_again(state: AppState, place: tuple[float, float], disparity: float) -> AppState:
    """Make the place that a photo was left focused on sharp at the depth that it has now."""
    if state.scene is None:
        return state
    optics = clamp_optics(focus_on(state.optics, place, disparity), state.scene)
    return replace(state, optics=optics, chosen_focus=optics.focus_disparity, focused_at=place)


set_existing_recent: Setter[tuple[str, ...]] = setter("existing_recent")
"""Offer those recent files that exist."""


def with_recent(recent: tuple[str, ...], path: str) -> tuple[str, ...]:
    """Return the recent paths with this one first."""
    return (path, *(other for other in recent if other != path))[:MAX_RECENT]


def other_recent(state: AppState) -> tuple[str, ...]:
    """Return the recent paths other than the open one."""
    return tuple(path for path in state.recent if state.source is None or path != state.source.path)


def names_of(paths: Sequence[str]) -> list[str]:
    """Return a short name for each path: its last part, with the folder if two are alike; of the views of a light field
    the light field's.
    """
    parts = [path.replace("\\", "/").rstrip("/").removesuffix("/views").split("/") for path in paths]
    names = [part[-1] for part in parts]
    has_twin = [names.count(name) > 1 and any(part[:-1]) for name, part in zip(names, parts)]
    return [f"{part[-1]} ({part[-2]})" if twin else part[-1] for twin, part in zip(has_twin, parts)]


def _begin_scene(state: AppState, old: Scene | None, scene: Scene) -> AppState:
    """Return the state of a scene that was not open before; nothing of the last one is kept."""
    recent, folder = state.recent, str(PurePath(scene.source.path).parent)
    is_step = state.folder is not None and state.folder.is_stepped_to(scene.source)
    if old is not None and is_step and state.folder is not None and state.folder.is_walk:
        recent = tuple(path for path in recent if path != old.source.path)  # a walk through a folder leaves one path
    found = state.inspection.for_next_scene
    if not is_ours(scene.source.path):
        state = replace(state, preferences=replace(state.preferences, opened_folder=os.path.abspath(folder)))
    state = replace(
        state,
        notices=tuple(notice for notice in state.notices if notice.is_result),
        history=History(),
        inspection=found if is_step else replace(found, overlay=None),
        motion=state.motion.stopped,
        recent=with_recent(recent, scene.source.path),
        folder=state.folder if state.folder is not None and state.folder.path == folder else None,
        depth=DepthSettings(scene.source.depth.refine),
        depth_strength=1.0 if old is not None else state.depth_strength,
        stroke=None,
        brush=replace(state.brush, sample=None),
        selection=None,
        tilt_handles=None,
        hover=None,
        zoom=None,
        chosen_focus=None,
        focus_before=None,
        has_chosen_aperture=False,
        focused_at=None,
    )
    state = _add_notices(state, scene)
    if scene.plan is None:
        return state
    facts = PlainTask("read facts", scene.source.path)
    return state.with_tasks(PlainTask("list folder", folder), facts, PlainTask("list models"))


def _add_notices(state: AppState, scene: Scene) -> AppState:
    notices = (*state.notices, *_problems(scene), *_offers(scene))
    return replace(state, notices=notices[-MAX_NOTICES:])


def _leave_source(state: AppState) -> AppState:
    """Return the state without the source that was asked for; the views of the open scene are made again."""
    state = replace(state, progress=Progress())
    if state.scene is None or state.scene.source is state.source:
        return state
    return replace(state, source=state.scene.source, generation=state.generation + 1)


def _with_settings(state: AppState, scene: Scene, settings: SavedSettings) -> AppState:
    if not is_finite(settings.optics):
        return state
    optics = clamp_optics(settings.optics_at(scene.width), scene)
    notices = tuple(notice for notice in state.notices if notice.offer != settings)
    return replace(state, optics=optics, notices=notices, motion=state.motion.stopped)


def _carried_focus(focus: float | None, optics: Optics, carried: Callable[[Optics], Optics]) -> float | None:
    """Return a focus in the disparity of the new scene."""
    if focus is None:
        return None
    return carried(replace(optics, focus_disparity=focus, focus_tilt=(0.0, 0.0))).focus_disparity


def _with_steady_focus(state: AppState, old: Scene, scene: Scene) -> Scene:
    """Return a light field of which more is known now, with a focus control that does not move by itself.

    The limits stay where they hold the disparity that was found; they always hold the focus that the user chose.
    """
    (low, high), (low_limit, high_limit) = scene.disparity_range_px, focus_limits(old)
    if old.has_view_disparity and low_limit <= low <= high <= high_limit:
        return replace(scene, disparity_range_px=old.disparity_range_px)
    if state.chosen_focus is None:
        return scene
    focus = state.optics.focus_disparity
    return replace(scene, disparity_range_px=(min(low, focus), max(high, focus)))


def _with_left_focus(state: AppState) -> AppState:
    """Return the state with the focus and aperture that the photo was left with, unless the user focused meanwhile."""
    left = state.models.left_focus
    if left is None or state.chosen_focus is not None or state.scene is None:
        return state
    optics = replace(with_focus_of(state.optics, left), aperture_diameter=left.aperture_diameter)
    optics = clamp_optics(optics, state.scene)
    models = replace(state.models, left_focus=None)
    return replace(state, optics=optics, chosen_focus=optics.focus_disparity, models=models)


def _with_restored_optics(shown: AppState, before: AppState, scene: Scene) -> AppState:
    """Return the state with the optics that the photo was left with, unless the user changed the lens meanwhile: they
    belong to the plan of the depth that it was left with.
    """
    if before.restoring is None or before.optics != before.restoring[0]:
        return shown
    optics = clamp_optics(before.restoring[1], scene)
    focus = None if shown.chosen_focus is None else optics.focus_disparity
    return replace(shown, optics=optics, chosen_focus=focus)


def _first_progress(state: AppState, scene: Scene) -> Progress:
    """Return the progress before the first report. A light field is shown several times and keeps its progress."""
    if scene.plan is None and state.progress.share > 0 and not state.progress.is_complete:
        return state.progress
    return Progress(doing=f"reading {scene.name}" if scene.is_sketch else "making views")


def _problems(scene: Scene) -> tuple[Notice, ...]:
    """Return a notice for each source of depth that failed, with buttons that give better depth if it is poor, and one
    for a file that is cut off.
    """
    is_poor = scene.depth_origin is not None and scene.depth_origin.is_poor
    failed = (Notice(problem, commands=DEPTH_COMMANDS if is_poor else ()) for problem in scene.problems)
    return (*(Notice(note) for note in scene.notes if note == CUT_OFF), *failed)


def _offers(scene: Scene) -> tuple[Notice, ...]:
    """Return the offer to take over the settings of a picture that this program saved."""
    if not scene.settings:
        return ()
    from viewer.model.saved_settings import left_out_note, settings_from_text

    try:
        settings = settings_from_text(scene.settings, scene.name)
    except InputError as error:
        return (Notice(str(error), is_error=True),)
    words = f"This picture was saved by iibr, with its settings. {left_out_note(settings)}"
    return (Notice(words.strip(), offer=settings),)
