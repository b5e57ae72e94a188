"""Computes the maps of a glossy surface in a thread; until they are ready, the picture shows no gloss."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.scene_gloss import GlossRequest, make_maps
from viewer.background.newest import Failed, Newest, Post
from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.state.notices import Notice

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps


class GlossFinder:
    """A thread for gloss maps; the newest request wins. asked: the last request."""

    def __init__(
        self,
        request_for: Callable[[Gloss | None], GlossRequest | None],
        take: Callable[[GlossMaps], None],
        wake: Callable[[], None],
    ) -> None:
        """request_for: returns the request for missing maps. take: shows maps. wake: called, in the thread, when there
        is a result.
        """
        self.asked: GlossRequest | None = None
        self._worker: Newest[GlossRequest, GlossMaps] = Newest("iibr-gloss", _make, wake)
        self._request_for, self._take = request_for, take

    def advance(self, gloss: Gloss | None) -> list[Action]:
        """Show new maps, report errors, and request missing maps. gloss: of the picture."""
        actions: list[Action] = []
        while (result := self._worker.next_result()) is not None:
            if isinstance(result, Failed):
                actions.append(do(messages.notify, Notice(result.message, is_error=True)))
            else:
                self._take(result)
        request = self._request_for(gloss)
        if request is not None and (self.asked is None or not self.asked.is_like(request)):
            self.asked = request
            self._worker.submit(request)
        return actions

    def close(self) -> None:
        """Stop the thread."""
        self._worker.close()


def _make(request: GlossRequest, post: Post[GlossMaps]) -> None:
    post(make_maps(request))
