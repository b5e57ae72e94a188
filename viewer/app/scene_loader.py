"""Has the scene made that the state asks for, and takes in what came of it; reads ahead what is likely to follow."""

from __future__ import annotations

from collections.abc import Callable

from iibr_core.types import InputError, ViewOffset
from viewer.background.jobs import Failed, ProgressReport
from viewer.background.read_ahead import PhotoAhead, PhotosAhead, photos_within_budget
from viewer.background.scene_worker import (
    PhotosFound,
    SceneReady,
    SceneRequest,
    SceneResult,
    SceneWorker,
    Sketched,
    SketchWorker,
    ViewReady,
)
from viewer.display.depth_preview import DepthPreview
from viewer.display.inspection_view import InspectionView
from viewer.display.scene_view import SceneView
from viewer.model.actions import Action, Notify, OpenFailed, OpenPath, ProgressMade, SceneOpened
from viewer.model.reducers.depth_editing import depth_settings_for_worker, is_depth_ahead
from viewer.model.reducers.folder import photos_ahead
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_editing import DepthSettings, DropStroke
from viewer.model.state.folder import ShowFilmstrip
from viewer.model.state.notices import Notice
from viewer.model.state.scene import Source, source_beside


class SceneLoader:
    """Everything is called from the one GL thread. ahead: photos that are read before they are asked for."""

    def __init__(
        self,
        scene_view: SceneView,
        inspection_view: InspectionView,
        set_title: Callable[[str], None],
        wake: Callable[[], None],
    ) -> None:
        """set_title: of the window that shows the scene. wake: called, in another thread, when there is a result."""
        self.ahead = PhotosAhead(wake)
        self._scene_view = scene_view
        self._inspection_view = inspection_view
        self._set_title = set_title
        self._worker = SceneWorker(wake)
        self._sketches = SketchWorker(wake)
        self._preview = DepthPreview(scene_view)
        self._submitted = self._to_sketch = self._sketched = 0
        self._depth_settings = DepthSettings()
        self._stopped: int | None = None

    def has_lost(self, state: AppState) -> bool:
        """Whether what the state waits for will never come."""
        return self._worker.is_lost and state.stopped != state.generation == self._submitted

    def look_from(self, eye: ViewOffset) -> None:
        """Views near this place are made first."""
        self._worker.eye = eye

    def take_results(self, state: AppState) -> list[Action]:
        """The worker's results, as actions; the one place where they arrive."""
        actions: list[Action] = []
        while (sketch := self._sketches.next_result()) is not None:
            actions += self._take_sketch(sketch, state)
        while self._scene_view.has_room and (result := self._worker.next_result()) is not None:
            actions += self._take(result, state)
        return actions

    def preview_depth(self, state: AppState) -> list[Action]:
        """While depth is edited, show it; the views of what it was before need not be made."""
        if not is_depth_ahead(state, self._depth_settings):
            return []
        self._worker.cancel()
        try:
            self._preview.update(state)
        except InputError as error:
            return [Notify(Notice(str(error), is_error=True)), DropStroke()]
        return []

    def advance(self, state: AppState) -> None:
        """Ask for what the state wants now, if that is news, and for what is likely to be wanted next."""
        self._cancel(state)
        is_wanted = state.generation not in (self._submitted, state.stopped)
        if is_wanted and state.source is not None and state.stroke is None:
            self._load(state, state.source)  # with a stroke under way it will be another one
        self._read_ahead(state)

    def close(self) -> None:
        """Stop making and reading."""
        self._worker.close()
        self._sketches.close()
        self.ahead.close()

    def _take_sketch(self, sketch: Sketched, state: AppState) -> list[Action]:
        self._sketched = sketch.generation
        is_news = self._scene_view.generation != sketch.generation == state.generation
        return self._take(sketch.ready, state) if is_news and sketch.ready is not None else []

    def _take(self, result: SceneResult, state: AppState) -> list[Action]:
        match result:
            case ProgressReport():
                return [ProgressMade(result.id, result.progress)]
            case Failed():
                return [OpenFailed(result.id, result.message)]
            case PhotosFound():
                return [OpenPath(source_beside(state.source, result.path)), ShowFilmstrip(True)]
        try:
            return self._take_views(result)
        except InputError as error:  # no room on the graphics card: there is no use in more views
            self._worker.cancel()
            return [OpenFailed(result.generation, str(error))]

    def _take_views(self, result: SceneReady | ViewReady) -> list[Action]:
        if isinstance(result, SceneReady):
            self._scene_view.open(result)
            self._inspection_view.open()
            self._set_title(f"{result.scene.name} - iibr")
            return [SceneOpened(result.generation, result.scene)]
        self._scene_view.add(result.view)
        self._inspection_view.add(result.view)
        return [ProgressMade(result.generation, result.progress, (result.view.row, result.view.column))]

    def _cancel(self, state: AppState) -> None:
        """What the user stopped, and what is wanted no more."""
        if state.stopped == state.generation != self._stopped:
            self._worker.cancel()
            self._sketches.cancel()
            self._stopped = state.stopped
        if self._scene_view.generation == state.generation < self._submitted:
            self._worker.cancel()  # another file was being read, and will not be opened: what is here is whole
            self._submitted, self._depth_settings = state.generation, depth_settings_for_worker(state)

    def _load(self, state: AppState, source: Source) -> None:
        """A new generation is a new job. The photo is read again only if another one was opened."""
        scene = state.scene
        loaded = self._scene_view.loaded if scene and scene.source is source else None
        if loaded is None and (self._awaits_sketch(state, source) or self.ahead.is_reading(source)):
            return
        ahead = self.ahead.take(source, state.depth_strength) if loaded is None else None
        if loaded is None:
            self._keep_left(state)
        self._submitted, self._depth_settings = state.generation, depth_settings_for_worker(state)
        loaded, plan = (ahead.loaded, ahead.plan) if ahead is not None else (loaded, None)
        self._worker.submit(
            SceneRequest(state.generation, source, state.depth_strength, loaded, self._depth_settings, plan=plan)
        )

    def _awaits_sketch(self, state: AppState, source: Source) -> bool:
        """Whether the photo is still being made ready to be shown in small. That comes first, and has the processor for
        itself; it is not made where all of the photo was read before.
        """
        if source in self.ahead.ready:
            return False
        if self._to_sketch != state.generation:
            self._to_sketch = state.generation
            self._worker.cancel()
            self._sketches.submit(SceneRequest(state.generation, source, state.depth_strength))
        return self._sketched != state.generation and not self._sketches.is_lost

    def _keep_left(self, state: AppState) -> None:
        """The photo that is left may be gone back to."""
        scene, loaded = state.scene, self._scene_view.loaded
        if scene is None or scene.plan is None or loaded is None:
            return
        if loaded.depth_settings == DepthSettings(scene.source.depth.refine):
            self.ahead.keep(PhotoAhead(scene.source, state.depth_strength, loaded, scene.plan))

    def _read_ahead(self, state: AppState) -> None:
        """What is likely to be opened next, once there is something to look at."""
        scene = state.scene
        if scene is not None and scene.source is state.source and not scene.is_sketch:
            wanted = photos_ahead(state)[: photos_within_budget(scene)]
            self.ahead.want(wanted, state.depth_strength)
