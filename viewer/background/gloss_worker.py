"""The maps of a glossy surface, computed in a thread; until they are there, the picture shows no gloss."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING

from iibr_core.gloss.settings import Gloss, GlossSurface
from iibr_core.runtime.work import Cancelled
from iibr_core.scenes.scene_gloss import GlossRequest, make_maps
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model.actions import Action, Notify
from viewer.model.state.notices import Notice

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps

    GlossResult = GlossMaps | Failed[GlossSurface]


class GlossFinder(JobThread[GlossRequest, "GlossResult"]):
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
        super().__init__("iibr-gloss", wake, _results_of, lambda asked, message: Failed(asked.surface, message))
        self.asked: GlossRequest | None = None
        self._request_for, self._take = request_for, take

    def advance(self, gloss: Gloss | None) -> list[Action]:
        """Show new maps, report errors, and request missing maps. gloss: of the picture."""
        actions: list[Action] = []
        while (result := self.next_result()) is not None:
            if isinstance(result, Failed):
                actions.append(Notify(Notice(result.message, is_error=True)))
            else:
                self._take(result)
        request = self._request_for(gloss)
        if request is not None and (self.asked is None or not self.asked.is_like(request)):
            self.asked = request
            self.submit(request)
        return actions


def _results_of(job: Job[GlossRequest, GlossResult]) -> Iterator[GlossResult]:
    with suppress(Cancelled):
        yield make_maps(job.request)
