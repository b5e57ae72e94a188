"""What a gloss means for the scene on the screen, found out beside the window; until then it looks as before."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress

from iibr_core.rendering.gloss.gloss_settings import Gloss
from iibr_core.runtime.work import Cancelled
from iibr_core.scenes.scene_gloss import GlossFound, GlossRequest, answer
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model.actions import Action, Notify
from viewer.model.state.notices import Notice

GlossResult = GlossFound | Failed[Gloss]


class GlossFinder(JobThread[GlossRequest, GlossResult]):
    """The newest request wins. asked: what was last to be found out."""

    def __init__(
        self,
        request_for: Callable[[Gloss | None], GlossRequest | None],
        take: Callable[[GlossFound], None],
        wake: Callable[[], None],
    ) -> None:
        """request_for: says what of a gloss is not known yet. take: shows what was found. wake: called, in the thread,
        when something is.
        """
        super().__init__("iibr-gloss", wake, _results_of, lambda asked, message: Failed(asked.gloss, message))
        self.asked: GlossRequest | None = None
        self._request_for, self._take = request_for, take

    def advance(self, gloss: Gloss | None) -> list[Action]:
        """Show what was found, say what went wrong, and ask for what is missing. gloss: of the picture."""
        actions: list[Action] = []
        while (result := self.next_result()) is not None:
            if isinstance(result, GlossFound):
                self._take(result)
            else:
                actions.append(Notify(Notice(result.message, is_error=True)))
        request = self._request_for(gloss)
        if request is not None and (self.asked is None or not self.asked.is_for(request.gloss, request.centre)):
            self.asked = request
            self.submit(request)
        return actions


def _results_of(job: Job[GlossRequest, GlossResult]) -> Iterator[GlossResult]:
    with suppress(Cancelled):
        yield answer(job.request)
