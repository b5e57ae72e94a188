"""Has the scene made that the state asks for, and takes in what came of it; reads ahead what is likely to follow."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace

from iibr_core.scenes.scene import (
    DepthSettings,
    LoadedPhoto,
    Scene,
    SceneReady,
    SceneRequest,
    Source,
    ViewReady,
    WantedPhoto,
    source_beside,
)
from iibr_core.types import InputError, ViewOffset
from viewer.background.depth_models import DepthFinder, focus_before_and_now
from viewer.background.file_worker import FileRequest, FileWorker
from viewer.background.job_threads import Failed, ProgressReport
from viewer.background.read_ahead import PhotoAhead, ReadAhead, photos_within_budget, read_sketch, read_whole_photo
from viewer.background.scene_worker import PhotosFound, SceneResult, SceneWorker
from viewer.display.depth_preview import DepthPreview
from viewer.display.inspection_view import InspectionView
from viewer.display.scene_view import SceneView
from viewer.model import depth, messages, opening, preferences
from viewer.model.action import Action, do
from viewer.model.carried_optics import NewDepth
from viewer.model.depth import is_ahead, settings_for_worker
from viewer.model.folder import AHEAD, SKETCHED_AHEAD, photos_ahead
from viewer.model.lens import requested_strength
from viewer.model.remedies import words_of
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice

SKETCHES_FIRST = 3
"""A photo and the next two are there in small before all of it is read: who goes on quickly meets none of that work.
The photo that is opened first does not wait for the next ones.
"""

PROGRESS_S = 0.25
"""While views come, their number is told this often: to show each would take a frame, and that the time of a fifth of a
view.
"""


class SceneLoader:
    """Everything is called from the one GL thread. ahead, sketches: photos that are read before they are asked for, and
    in small.
    """

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
        self._worker = SceneWorker(wake)
        self._preview = DepthPreview(scene_view)
        self._depth_finder = DepthFinder(wake)
        self._brush_loader = FileWorker("iibr-brush", wake)
        self._has_brush = False
        self._submitted = 0
        self._depth_settings = DepthSettings()
        self._stopped: int | None = None
        self._room_beside: tuple[Scene, int] | None = None
        self._held: list[Action] = []
        self._reported_at = 0.0
        self._is_urgent = False

    def look_from(self, eye: ViewOffset) -> None:
        """Views near this place are made first."""
        self._worker.eye = eye

    def take_results(self, state: AppState, until: float) -> list[Action]:
        """The worker's results, as actions, until then on the clock, at least one; the one place where they arrive.
        Progress alone is told every PROGRESS_S, and when it is complete.
        """
        actions = self._show_sketch(state) + self._depth_finder.advance(state, self._scene_view.loaded)
        while self._scene_view.has_room and (result := self._worker.next_result()) is not None:
            self._held += self._take(result, state)
            self._is_urgent |= not (isinstance(result, ViewReady | ProgressReport) and not result.progress.is_complete)
            if time.perf_counter() >= until:
                break
        self._held += actions
        self._is_urgent |= bool(actions)
        return self._take_held()

    @property
    def holds_progress(self) -> bool:
        """Whether progress was made that the state does not show yet."""
        return bool(self._held)

    def preview_depth(self, state: AppState) -> list[Action]:
        """While depth is edited, show it; the views of what it was before need not be made."""
        if not is_ahead(state, self._depth_settings):
            return []
        self._worker.cancel()
        try:
            self._preview.update(state)
        except InputError as error:
            return [do(messages.notify, Notice(str(error), is_error=True)), do(depth.drop_stroke)]
        return []

    def advance(self, state: AppState) -> None:
        """Ask for what the state wants now, if that is news, and for what is likely to be wanted next."""
        self._cancel(state)
        self._read_sketches(state)
        is_wanted = state.generation not in (self._submitted, state.stopped)
        if is_wanted and state.source is not None and state.stroke is None:
            self._load(state, state.source)  # with a stroke under way it will be another one
        self._read_ahead(state)

    def close(self) -> None:
        """Stop making and reading."""
        self._worker.close()
        self._depth_finder.close()
        self.sketches.close()
        self.ahead.close()
        self._brush_loader.close()

    def _take_held(self) -> list[Action]:
        """Return the actions that are due: progress alone only now and then."""
        now = time.perf_counter()
        if not self._is_urgent and now - self._reported_at < PROGRESS_S:
            return []
        actions, self._held, self._is_urgent = self._held, [], False
        self._reported_at = now if actions else self._reported_at
        return actions

    def _show_sketch(self, state: AppState) -> list[Action]:
        """What was asked for, in small, as long as nothing else of it is there."""
        if state.source is None or self._scene_view.generation == state.generation or self._reuses_photo(state):
            return []
        sketch = self.sketches.get(WantedPhoto(state.source, requested_strength(state)))
        return self._take(replace(sketch, generation=state.generation), state) if sketch is not None else []

    def _take(self, result: SceneResult, state: AppState) -> list[Action]:
        match result:
            case ProgressReport():
                return [do(opening.set_progress, result.id, result.progress)]
            case Failed():
                return [do(opening.report_failure, result.id, result.message)]
            case PhotosFound():
                return [
                    do(opening.open_source, source_beside(state.source, result.path)),
                    do(preferences.show_filmstrip, True),
                ]
        try:
            return self._take_views(result, state)
        except InputError as error:  # no room on the graphics card: there is no use in more views
            self._worker.cancel()
            return [do(opening.report_failure, result.generation, words_of(error))]

    def _take_views(self, result: SceneReady | ViewReady, state: AppState) -> list[Action]:
        if result.generation < self._scene_view.generation:
            return []  # the small picture of another photo is shown by now
        if isinstance(result, SceneReady):
            before, centre = self._scene_view.loaded, self._scene_view.centre
            self._scene_view.open(result)
            if before is None or result.loaded is None or result.loaded.photo is not before.photo:
                self._preview.forget()
            self._inspection_view.open()
            self._set_title(f"{result.scene.name} - iibr")
            self._load_brush(result)
            is_deepened = before is not None and _has_other_depth(before, result.loaded)
            before_px, now_px = centre.disparity if centre is not None else None, result.centre.disparity
            new_depth = None
            if is_deepened and before_px is not None and now_px is not None:
                new_depth = NewDepth(focus_before_and_now(before_px, now_px, state.focused_at))
            return [do(opening.show_scene, result.generation, result.scene, new_depth)]
        self._scene_view.add(result.view)
        self._inspection_view.add(result.view)
        return [do(opening.set_progress, result.generation, result.progress, (result.view.row, result.view.column))]

    def _load_brush(self, ready: SceneReady) -> None:
        """Beside the first photo's views, so that the first stroke does not wait."""
        if not self._has_brush and ready.loaded is not None:
            self._has_brush = True
            self._brush_loader.submit(FileRequest(0, _prepare_brush))

    def _cancel(self, state: AppState) -> None:
        """What the user stopped, and what is wanted no more."""
        if state.stopped == state.generation != self._stopped:
            self._worker.cancel()
            self._stopped = state.stopped
        if self._scene_view.generation == state.generation < self._submitted:
            self._worker.cancel()  # another file was being read, and will not be opened: what is here is whole
            self._submitted, self._depth_settings = state.generation, settings_for_worker(state)

    def _load(self, state: AppState, source: Source) -> None:
        """A new generation is a new job. The photo is read again only if another one was opened."""
        loaded, plan = self._depth_finder.newest(self._scene_view.loaded), None
        if not self._reuses_photo(state):
            self._keep_left(state)
            self._worker.cancel()
            photo = WantedPhoto(source, requested_strength(state))
            ahead = self.ahead.get(photo)
            if ahead is None and (self.ahead.is_reading(photo) or not self._has_sketches(state)):
                return
            loaded, plan = (ahead.loaded, ahead.plan) if ahead is not None else (None, None)
        self._submitted, self._depth_settings = state.generation, settings_for_worker(state)
        self._worker.submit(
            SceneRequest(
                state.generation,
                source,
                requested_strength(state),
                loaded,
                self._depth_settings,
                plan=plan,
                asks_model=False,
            )
        )

    def _reuses_photo(self, state: AppState) -> bool:
        """Whether the photo that is asked for is open, and all of it was read."""
        scene = state.scene
        return scene is not None and scene.source is state.source and self._scene_view.loaded is not None

    def _keep_left(self, state: AppState) -> None:
        """The photo that is left may be gone back to."""
        scene, loaded = state.scene, self._scene_view.loaded
        if scene is None or scene.plan is None or loaded is None:
            return
        if loaded.depth_settings == DepthSettings(scene.source.depth.refine):
            left = PhotoAhead(loaded.without_history(), scene.plan)
            self.ahead.keep(WantedPhoto(scene.source, state.depth_strength), left)

    def _read_sketches(self, state: AppState) -> None:
        """Of what is asked for and what is likely to be next. While the open photo's views are made they can wait."""
        if _is_whole(state) and not state.progress.is_complete:
            return
        self.sketches.want(_photos_to_sketch(state) if state.stopped != state.generation else ())

    def _has_sketches(self, state: AppState) -> bool:
        count = SKETCHES_FIRST if self._submitted else 1
        return all(map(self.sketches.is_done, _photos_to_sketch(state)[:count]))

    def _read_ahead(self, state: AppState) -> None:
        """What is likely to be opened next, once all of this photo is there; on the way to it nothing is begun."""
        if state.scene is None or state.source is None:
            return
        photos = _wanted(state, (state.source, *photos_ahead(state, AHEAD)))
        if _is_whole(state):
            self.ahead.want(photos[1 : 1 + self._photos_beside(state.scene)])
        else:
            is_begun = self.ahead.is_reading(photos[0])
            self.ahead.want([*photos[:is_begun], *filter(self.ahead.is_done, photos)])

    def _photos_beside(self, scene: Scene) -> int:
        """`photos_within_budget`, looked up once a scene: it reads a dozen files of the system."""
        if self._room_beside is None or self._room_beside[0] is not scene:
            self._room_beside = scene, photos_within_budget(scene)
        return self._room_beside[1]


def _has_other_depth(before: LoadedPhoto, now: LoadedPhoto | None) -> bool:
    """Whether the same photo's depth was found again."""
    return now is not None and now.photo is before.photo and now.found is not before.found


def _prepare_brush() -> None:
    from iibr_core.scenes.photo import prepare_brush

    prepare_brush()


def _is_whole(state: AppState) -> bool:
    """Whether all of what is asked for is read and shown."""
    scene = state.scene
    return scene is not None and scene.source is state.source and not scene.is_sketch


def _photos_to_sketch(state: AppState) -> list[WantedPhoto]:
    """What is asked for, and what is likely to be next."""
    return [] if state.source is None else _wanted(state, (state.source, *photos_ahead(state, SKETCHED_AHEAD)))


def _wanted(state: AppState, sources: Iterable[Source]) -> list[WantedPhoto]:
    strength = requested_strength(state)
    return [WantedPhoto(source, strength if source is state.source else 1.0) for source in sources]
