"""What a gloss means for the scene on the screen, found out beside the window; until then it looks as before."""

from __future__ import annotations

from collections.abc import Callable

from iibr_core.scenes import GlossFound, GlossRequest
from viewer.background.gloss import GlossWorker
from viewer.display.scene_view import SceneView
from viewer.model.actions import Action, Notify
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice


class GlossFinder:
    """Everything is called from the one GL thread. asked: what was last to be found out."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the finding thread, when something is found."""
        self.asked: GlossRequest | None = None
        self._scene_view = scene_view
        self._worker = GlossWorker(wake)

    def advance(self, state: AppState) -> list[Action]:
        """Show what was found, say what went wrong, and ask for what is missing."""
        actions: list[Action] = []
        while (result := self._worker.next_result()) is not None:
            if isinstance(result, GlossFound):
                self._scene_view.take_gloss(result)
            else:
                actions.append(Notify(Notice(result.message, is_error=True)))
        request = self._scene_view.gloss_request(state.optics.gloss)
        if request is not None and (self.asked is None or not self.asked.is_for(request.gloss, request.centre)):
            self.asked = request
            self._worker.submit(request)
        return actions

    def close(self) -> None:
        """Stop finding out."""
        self._worker.close()
