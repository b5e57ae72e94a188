"""Loads scenes: submits what the state asks for, takes in the results, and reads the next photos ahead."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace

from iibr_core.scenes.scene import (
    DepthSettings,
    SceneReady,
    SceneRequest,
    Source,
    ViewReady,
    WantedPhoto,
    source_beside,
)
from iibr_core.types import InputError, ViewOffset
from viewer.background.depth_models import DepthFinder, focus_before_and_now
from viewer.background.newest import Failed, Finder, Newest, Post
from viewer.background.read_ahead import PhotoAhead, ReadAhead, photos_within_budget, read_sketch, read_whole_photo
from viewer.background.scene_worker import PhotosFound, SceneResult, SceneWork, WorkReport
from viewer.display.depth_preview import DepthPreview
from viewer.display.inspection_view import InspectionView
from viewer.display.scene_view import SceneView
from viewer.model import depth, messages, opening, preferences
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.carried_optics import NewDepth
from viewer.model.depth import is_ahead, settings_for_worker
from viewer.model.folder import AHEAD, SKETCHED_AHEAD, photos_ahead
from viewer.model.lens import requested_strength
from viewer.model.messages import Notice
from viewer.model.remedies import words_of

SKETCHES_FIRST = 3
"""Number of photos that are read at a small size before the open photo is read whole, so that quick steps show a
picture. The first photo does not wait for the next ones.
"""
TAKING_S = 0.006
"""Time for results in a turn of the loop, in seconds."""
PROGRESS_S = 0.25
"""Time between two updates of the progress, in seconds: each update draws a frame."""


class SceneLoader:
    """Call it from the GL thread. ahead, sketches: photos read before they are asked for, whole and at a small size."""

    def __init__(
        self,
        scene_view: SceneView,
        inspection_view: InspectionView,
        set_title: Callable[[str], None],
        wake: Callable[[], None],
    ) -> None:
        """set_title: of the window that shows the scene. wake: called, in another thread, when there is a result."""
        self.ahead = ReadAhead("iibr-ahead", wake, read_whole_photo)
        self.sketches = ReadAhead("iibr-sketches", wake, read_sketch)
        self._scene_view = scene_view
        self._inspection_view = inspection_view
        self._set_title = set_title
        self._work = SceneWork()
        self._worker = Newest("iibr-scene", self._work, wake)
        self._preview = DepthPreview(scene_view)
        self._depth_finder = DepthFinder(lambda: scene_view.loaded, wake)
        self._brush_loader = Finder(Newest("iibr-brush", _prepare_brush, wake), self._brush_request, lambda _: None)
        self._submitted = 0
        self._depth_settings = DepthSettings()
        self._stopped: int | None = None
        self._room_beside = 0
        self._held: list[Action] = []
        self._is_urgent = False
        self._reported_at = 0.0

    def look_from(self, eye: ViewOffset) -> None:
        """Make views near this viewpoint first."""
        self._work.eye = eye

    def advance(self, state: AppState) -> list[Action]:
        """Submit the source that the state asks for, read the next photos, and show what came of it."""
        if sketch := self._show_sketch(state):
            return sketch  # the rest goes by the state that shows it
        if state.stopped == state.generation != self._stopped:
            self._worker.cancel()
            self._stopped = state.stopped
        self._read_sketches(state)
        is_wanted = state.generation not in (self._submitted, state.stopped)
        if is_wanted and state.source is not None and state.stroke is None:
            self._load(state, state.source)
        self._read_ahead(state)
        return self._preview_depth(state) + self._take_results(state) + self._brush_loader.advance(state)

    def _take_results(self, state: AppState) -> list[Action]:
        """Return results as actions, at least one result, and more until TAKING_S are over.

        Progress alone is returned every PROGRESS_S, and when it is complete.
        """
        until = time.perf_counter() + TAKING_S
        actions = self._depth_finder.advance(state)
        while self._scene_view.has_room and (result := self._worker.next_result()) is not None:
            self._held += self._take(result, state)
            self._is_urgent |= not (isinstance(result, ViewReady | WorkReport) and not result.progress.is_complete)
            if time.perf_counter() >= until:
                break
        now = time.perf_counter()
        if not (actions or self._is_urgent) and now - self._reported_at < PROGRESS_S:
            return []
        actions, self._held, self._is_urgent = self._held + actions, [], False
        self._reported_at = now if actions else self._reported_at
        return actions

    @property
    def holds_progress(self) -> bool:
        """Whether progress was made that the state does not show yet."""
        return bool(self._held)

    def _preview_depth(self, state: AppState) -> list[Action]:
        """Show the depth while it is edited; stop making views of the depth before."""
        if not is_ahead(state, self._depth_settings):
            return []
        self._worker.cancel()
        try:
            self._preview.update(state)
        except InputError as error:
            return [do(messages.notify, Notice(words_of(error), is_error=True)), do(depth.drop_stroke)]
        return []

    def close(self) -> None:
        """Stop making and reading."""
        self._worker.close()
        self._depth_finder.close()
        self.sketches.close()
        self.ahead.close()
        self._brush_loader.close()

    def _show_sketch(self, state: AppState) -> list[Action]:
        """Show the sketch of the photo that was asked for while nothing else of it is there."""
        if state.source is None or self._scene_view.generation == state.generation or self._reuses_photo(state):
            return []
        sketch = self.sketches.get(WantedPhoto(state.source, requested_strength(state)))
        return self._take(replace(sketch, generation=state.generation), state) if sketch is not None else []

    def _take(self, result: SceneResult, state: AppState) -> list[Action]:
        match result:
            case WorkReport():
                return [do(opening.set_progress, result.generation, result.progress)]
            case Failed():
                return [do(opening.report_failure, result.request.generation, result.message)]
            case PhotosFound():
                source = source_beside(state.source, result.path)
                return [do(opening.open_source, source), do(preferences.show_filmstrip, True)]
        try:
            return self._take_views(result, state)
        except InputError as error:  # the graphics card has no room
            self._worker.cancel()
            return [do(opening.report_failure, result.generation, words_of(error))]

    def _take_views(self, result: SceneReady | ViewReady, state: AppState) -> list[Action]:
        if result.generation < self._scene_view.generation:
            return []  # the sketch of another photo is shown by now
        if isinstance(result, SceneReady):
            return [self._open(result, state)]
        self._scene_view.add(result.view)
        self._scene_view.take_hidden(result.hidden)
        self._inspection_view.add(result.view)
        return [do(opening.set_progress, result.generation, result.progress, (result.view.row, result.view.column))]

    def _open(self, ready: SceneReady, state: AppState) -> Action:
        """Show a scene."""
        before, centre, loaded, new_depth = self._scene_view.loaded, self._scene_view.centre, ready.loaded, None
        is_same_photo = before is not None and loaded is not None and loaded.photo.pixels is before.photo.pixels
        self._scene_view.open(ready)
        self._inspection_view.open()
        self._set_title(f"{ready.scene.name} - iibr")
        self._room_beside = photos_within_budget(ready.scene)
        if not is_same_photo:
            self._preview.forget()
        elif before is not None and loaded is not None and loaded.found is not before.found:
            before_px, now_px = centre.disparity if centre is not None else None, ready.centre.disparity
            if before_px is not None and now_px is not None:
                new_depth = NewDepth(focus_before_and_now(before_px, now_px, state.focused_at))
        return do(opening.show_scene, ready.generation, ready.scene, new_depth)

    def _load(self, state: AppState, source: Source) -> None:
        """Submit a new generation. The photo is read again only if another one was opened."""
        loaded, plan = self._depth_finder.newest(), None
        if not self._reuses_photo(state):
            self._keep_left(state)
            self._worker.cancel()
            photo = WantedPhoto(source, requested_strength(state))
            ahead = self.ahead.get(photo)
            if ahead is None and (self.ahead.is_reading(photo) or not self._has_sketches(state)):
                return
            loaded, plan = (ahead.loaded, ahead.plan) if ahead is not None else (None, None)
        self._submitted, self._depth_settings = state.generation, settings_for_worker(state)
        strength, settings = requested_strength(state), self._depth_settings
        request = SceneRequest(state.generation, source, strength, loaded, settings, plan=plan, asks_model=False)
        self._worker.submit(request)

    def _brush_request(self, state: AppState) -> str | None:
        """Return that the brush is prepared, once a photo's views are there: then the first stroke does not wait."""
        is_next = self._scene_view.loaded is not None and (state.progress.is_complete or state.brush.is_on)
        return "brush" if is_next else None

    def _reuses_photo(self, state: AppState) -> bool:
        """Return whether the photo that is asked for is open, and all of it was read."""
        scene = state.scene
        return scene is not None and scene.source is state.source and self._scene_view.loaded is not None

    def _keep_left(self, state: AppState) -> None:
        """Keep the photo that is left: one may go back to it."""
        scene, loaded = state.scene, self._scene_view.loaded
        if scene is None or scene.plan is None or loaded is None:
            return
        if loaded.depth_settings == DepthSettings(scene.source.depth.refine):
            left = PhotoAhead(loaded.without_history(), scene.plan)
            self.ahead.keep(WantedPhoto(scene.source, state.depth_strength), left)

    def _read_sketches(self, state: AppState) -> None:
        """Read sketches of this and the next photos, but not while views are made."""
        if _is_whole(state) and not state.progress.is_complete:
            return
        self.sketches.want(_photos_to_sketch(state) if state.stopped != state.generation else ())

    def _has_sketches(self, state: AppState) -> bool:
        count = SKETCHES_FIRST if self._submitted else 1
        return all(map(self.sketches.is_done, _photos_to_sketch(state)[:count]))

    def _read_ahead(self, state: AppState) -> None:
        """Read the next photos once all of this one is there; before that, only finish what was begun."""
        if state.scene is None or state.source is None:
            return
        photos = _wanted(state, (state.source, *photos_ahead(state, AHEAD)))
        if _is_whole(state):
            self.ahead.want(photos[1 : 1 + self._room_beside])
        else:
            is_begun = self.ahead.is_reading(photos[0])
            self.ahead.want([*photos[:is_begun], *filter(self.ahead.is_done, photos)])


def _prepare_brush(request: str, post: Post[None]) -> None:
    from iibr_core.scenes.photo import prepare_brush

    prepare_brush()


def _is_whole(state: AppState) -> bool:
    """Return whether the source that is asked for is read whole and shown."""
    scene = state.scene
    return scene is not None and scene.source is state.source and not scene.is_sketch


def _photos_to_sketch(state: AppState) -> list[WantedPhoto]:
    """Return the photo that is asked for, and those that are likely to be next."""
    return [] if state.source is None else _wanted(state, (state.source, *photos_ahead(state, SKETCHED_AHEAD)))


def _wanted(state: AppState, sources: Iterable[Source]) -> list[WantedPhoto]:
    strength = requested_strength(state)
    return [WantedPhoto(source, strength if source is state.source else 1.0) for source in sources]
