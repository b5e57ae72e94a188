"""Has a depth model asked about the photo on the screen where the state wants that, beside the window."""

from __future__ import annotations

from collections.abc import Callable

from iibr_core.scenes import LoadedPhoto
from viewer.background.depth_estimate import DepthEstimates, Estimated, EstimateRequest, EstimateResult
from viewer.background.jobs import Failed
from viewer.display.scene_view import SceneView
from viewer.model.actions import Action, Notify
from viewer.model.reducers.depth_models import wanted_model
from viewer.model.state.app_state import AppState
from viewer.model.state.model_download import DepthEstimated, GiveUpEstimate
from viewer.model.window_words import notice_in_window

STOPPED = "Estimating depth stopped unexpectedly."


class DepthFinder:
    """Everything is called from the one GL thread."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the estimating thread, when there is news."""
        self._scene_view = scene_view
        self._estimates = DepthEstimates(wake)
        self._asked: EstimateRequest | None = None
        self._found: LoadedPhoto | None = None

    def advance(self, state: AppState) -> list[Action]:
        """Say what came, and ask for what is wanted now."""
        actions = [action for result in self._results() for action in self._take(result)]
        loaded, model = self._scene_view.loaded, wanted_model(state)
        if actions:
            return actions
        if model is None or loaded is None:
            if self._asked is not None:
                self._estimates.cancel()
                self._asked = None
        elif self._asked is None or not self._asked.is_for(loaded, model):
            self._asked = EstimateRequest(state.scene.source, loaded, model, state.depth.refine)  # type: ignore[union-attr]
            self._estimates.submit(self._asked)
        elif self._estimates.is_lost:
            return self._fail(STOPPED)
        return []

    def newest(self, loaded: LoadedPhoto | None) -> LoadedPhoto | None:
        """The photo that is shown, with the depth found for it since, where that is not shown yet."""
        found = self._found
        if loaded is None or found is None or found.photo is not loaded.photo or found.found is loaded.found:
            self._found = None
            return loaded
        return found

    def close(self) -> None:
        """Give up what is under way."""
        self._estimates.close()

    def _results(self) -> list[EstimateResult]:
        results = []
        while (result := self._estimates.next_result()) is not None:
            results.append(result)
        return results

    def _take(self, result: EstimateResult) -> list[Action]:
        match result:
            case Failed():
                return self._fail(result.message)
            case Estimated(request, loaded):
                self._asked, self._found = None, loaded
                return [DepthEstimated(request.model)]

    def _fail(self, message: str) -> list[Action]:
        self._asked = None
        return [GiveUpEstimate(), Notify(notice_in_window(message, is_error=True))]
